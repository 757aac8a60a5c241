# SPDX-License-Identifier: Apache-2.0
"""The grid of a sweep: every log with every combination of values."""

import hashlib
import itertools
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

from ignis.errors import InputError
from ignis.mounts import refuse_mounts

Changes = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Task:
    """One replay. Plain values only, so that it travels to other machines, which share the file system."""

    log: str
    config: str
    changes: Changes
    options: tuple[str, ...]  # of lio_replay
    folder: str

    @property
    def title(self) -> str:
        """For people."""
        return " ".join([Path(self.log).stem, *(f"{key}={value}" for key, value in self.changes)])


def parse_axes(texts: list[str]) -> dict[str, list[str]]:
    """section.key=a,b,c, one a parameter; commas inside of brackets and quotes belong to the value."""
    refuse_mounts(texts)
    axes: dict[str, list[str]] = {}
    for text in texts:
        key, equals, values = text.partition("=")
        if not equals or "." not in key or not values:
            raise InputError(f"--set {text}: write section.key=a,b,c")
        if key in axes:
            raise InputError(f"--set {key}: given twice; put all values into one list")
        axes[key] = _split(values)
        if len(set(axes[key])) != len(axes[key]) or "" in axes[key]:
            raise InputError(f"--set {text}: values are doubled or empty")
    return axes


def _split(values: str) -> list[str]:
    parts, depth, quoted = [""], 0, False
    for letter in values:
        quoted ^= letter == '"'
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def combinations(axes: dict[str, list[str]]) -> list[Changes]:
    """The last parameter changes fastest; one empty combination without any."""
    return [tuple(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def refuse_bad_combinations(front_end: Path, config: Path, chosen: list[Changes]) -> None:
    """Lets the front end check each combination before anything runs; one message names what each one offends."""
    complaints = []
    for changes in chosen:
        command = [str(front_end), "--config", str(config), "--print-config"]
        for key, value in changes:
            command += ["--set", f"{key}={value}"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            title = " ".join(f"{key}={value}" for key, value in changes)
            complaints.append(f"{title}: {done.stderr.strip().removeprefix('lio_frontend: ')}")
    if complaints:
        raise InputError(f"{len(complaints)} of {len(chosen)} combinations are refused:\n" + "\n".join(complaints))


def tasks_of(
    logs: list[Path], config: Path, chosen: list[Changes], options: tuple[str, ...], folder: Path, build: str
) -> list[Task]:
    """All replays; each has a folder named by what it depends on, so that a second sweep finds what the first did."""
    tasks = []
    content = config.read_text(encoding="utf-8")
    for log, changes in itertools.product(logs, chosen):
        resolved = log.resolve()
        said = json.dumps([str(resolved), resolved.stat().st_size, content, changes, options, build])
        digest = hashlib.sha256(said.encode()).hexdigest()[:16]
        run = folder.resolve() / "runs" / f"{log.stem}_{digest}"
        tasks.append(Task(str(resolved), str(config.resolve()), changes, options, str(run)))
    return tasks
