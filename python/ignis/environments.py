# SPDX-License-Identifier: Apache-2.0
"""Python environments beside our own, for packages whose pins exclude ours. Made once per list of versions."""

import hashlib
import os
import subprocess
import venv
from pathlib import Path

from ignis.errors import InputError


def default_cache() -> Path:
    """Where `./ignis` keeps what it makes once."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(os.environ.get("IGNIS_CACHE") or f"{base}/ignis")


def environment_python(name: str, requirements: Path, cache: Path) -> Path:
    """The Python of the environment `name`, installed now if it was not yet."""
    digest = hashlib.sha256(requirements.read_bytes()).hexdigest()[:12]
    folder = cache / f"{name}-{digest}"
    python = folder / "bin" / "python3"
    if (folder / "ready").exists():
        return python
    print(f"ignis: installing {requirements.name} into an environment of its own (once)", flush=True)
    venv.create(folder, with_pip=True, clear=True)
    # Newer tags of wheels are unknown to the pip that the interpreter brings.
    for what in (["--upgrade", "pip"], ["--requirement", str(requirements)]):
        command = [str(python), "-m", "pip", "install", "--quiet", *what]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            # The first line has the cause ("Network is unreachable"), the last only what follows from it.
            lines = done.stderr.strip().splitlines() or ["no message"]
            said = " ... ".join(dict.fromkeys((lines[0], lines[-1])))
            raise InputError(f"{requirements.name} could not be installed (is the network up?): {said}")
    (folder / "ready").touch()
    return python
