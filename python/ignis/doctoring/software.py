# SPDX-License-Identifier: Apache-2.0
"""The installation: executables of one version, the types jar for lcm-spy, Java."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path

from ignis.bus import message_types
from ignis.doctoring.finding import Finding, Severity

EXECUTABLES = ("l1_driver", "lio_frontend", "graph_backend", "map_builder", "l1_tool")


def check_software(folder: Path, jar: Path) -> Iterator[Finding]:
    """All of this module. `folder`: of the executables."""
    yield check_versions(folder)
    yield check_jar(jar)
    if shutil.which("java") is None:
        fix = "sudo apt-get install default-jre   # or use ./ignis echo and ./ignis hz"
        yield Finding("software", "java", Severity.NOTE, "no Java: ./ignis spy cannot run", fix)


def check_versions(folder: Path) -> Finding:
    """Every executable is there, runs and is of the same version."""
    versions: dict[str, str] = {}
    for name in EXECUTABLES:
        try:
            done = subprocess.run([folder / name, "--version"], capture_output=True, text=True, check=True, timeout=20)
            versions[name] = done.stdout.strip()
        except (OSError, subprocess.SubprocessError) as error:
            text = f"{folder / name} does not run: {type(error).__name__}"
            return Finding("software", "executables", Severity.ERROR, text, "./ignis build")
    if len(set(versions.values())) > 1:
        each = ", ".join(f"{name} {version}" for name, version in versions.items())
        return Finding("software", "executables", Severity.ERROR, f"of several versions: {each}", "./ignis build")
    return Finding("software", "executables", Severity.OK, f"version {next(iter(versions.values()))}")


def check_jar(jar: Path) -> Finding:
    """The jar holds all of our types; an old one shows messages as undecodable."""
    try:
        with zipfile.ZipFile(jar) as archive:
            inside = {Path(name).stem for name in archive.namelist() if name.endswith(".class")}
    except (OSError, zipfile.BadZipFile):
        return Finding("software", "types jar", Severity.WARNING, f"{jar} is missing or damaged", "./ignis build")
    missing = sorted({kind.__name__ for kind in message_types().values()} - inside)
    if missing:
        return Finding("software", "types jar", Severity.WARNING, f"{jar} lacks {', '.join(missing)}", "./ignis build")
    return Finding("software", "types jar", Severity.OK, f"{len(message_types())} types")
