# SPDX-License-Identifier: Apache-2.0
"""Where things are: in a checkout with its build, or where the Debian package put them."""

from __future__ import annotations

import os
from pathlib import Path


def program_folder() -> Path:
    """Executables of this build or installation."""
    return Path(os.environ["IGNIS_BUILD"]) / "bin"


def types_jar() -> Path:
    """Message types for lcm-spy."""
    return Path(os.environ.get("IGNIS_JAR") or Path(os.environ["IGNIS_BUILD"]) / "share" / "ignis_types.jar")


def default_config() -> Path:
    """The vehicle's configuration."""
    given = os.environ.get("IGNIS_CONFIG")
    return Path(given) if given else Path(os.environ["IGNIS_CHECKOUT"]) / "config" / "ignis8_tuned.json"
