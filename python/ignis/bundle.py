# SPDX-License-Identifier: Apache-2.0
"""`./ignis bundle`: one archive for a bug report.

Configuration, versions, the last 60 seconds of the log, counters and what the processes said. No map, and nothing from
outside of the given run or log; look at README.txt inside before you send it.
"""

import argparse
import io
import json
import platform
import subprocess
import sys
import tarfile
import time
from collections import Counter
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from ignis.errors import InputError, run_command
from ignis.files import replacing
from ignis.importing import detect
from ignis.log_config import recorded_config
from ignis.logs import LogDamage, LogEvent, LogWriter, read_events, read_log
from ignis.pipeline import binary
from ignis.run_folder import is_run, read_json

_RUN_FILES = (
    "report.json", "config.json", "recorded_config.json", "summary.json", "compare.json", "scan_stats.csv", "loops.csv",
    "timing.csv", "eskf_states.csv", "eskf.tum", "smoothed.tum", "ground_truth.tum", "keyframes.g2o",
)  # fmt: skip
_PROGRAM_LOGS = "logs/*.log"
_MOST_LOG_BYTES = 1_000_000
_PACKAGES = ("lcm", "numpy", "scipy", "evo", "rosbags", "mcap", "matplotlib")


class Bundle:
    """An archive in the making, with a list of what is inside."""

    def __init__(self, archive: tarfile.TarFile, name: str) -> None:
        self._archive, self._name = archive, name
        self.content: list[tuple[str, str]] = []

    def add_bytes(self, name: str, data: bytes, what: str) -> None:
        member = tarfile.TarInfo(f"{self._name}/{name}")
        member.size, member.mtime = len(data), int(time.time())
        self._archive.addfile(member, io.BytesIO(data))
        self.content.append((name, what))

    def add_json(self, name: str, value: Any, what: str) -> None:
        self.add_bytes(name, (json.dumps(value, indent=2, default=_plain) + "\n").encode(), what)

    def add_file(self, name: str, path: Path, what: str) -> None:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - _MOST_LOG_BYTES) if path.suffix == ".log" else 0)
            self.add_bytes(name, file.read(), what)

    def add_contents(self) -> None:
        lines = [f"{name:28} {what}" for name, what in self.content]
        self.add_bytes("README.txt", ("\n".join(["What is in this archive:", "", *lines]) + "\n").encode(), "this list")


def bundle(source: Path, output: Path | None, seconds: float) -> Path:
    """Writes the archive and returns its path."""
    run = source if source.is_dir() else None
    if run is not None and not is_run(run) and not (run / "run.lcmlog").is_file():
        raise InputError(f"{source} is no results folder of a replay or a demo; give one, or an LCM log")
    if run is None and detect(source) != "lcm":
        raise InputError(f"{source} is no LCM log")
    log = _log_of(run) if run is not None else source
    name = f"ignis-bundle-{source.resolve().name.removesuffix('.lcmlog')}"
    out = output or Path(f"{name}.tar.gz")
    with replacing(out) as temporary, tarfile.open(temporary, "w:gz") as archive:
        made = Bundle(archive, name)
        made.add_json("versions.json", versions(), "this build and what it runs on")
        if run is not None:
            _add_run(made, run)
        if log is not None:
            _add_log(made, log, seconds)
        made.add_contents()
    return out


def _log_of(run: Path) -> Path | None:
    if (run / "run.lcmlog").is_file():
        return run / "run.lcmlog"
    path = Path(read_json(run / "report.json").get("log_path", ""))
    if path.is_file():
        return path
    print(f"  the log {path.name} of this run no longer lies where it was: not included", file=sys.stderr)
    return None


def versions() -> dict[str, Any]:
    """Of our build, the system and the packages."""

    def said(*command: object) -> str:
        try:
            done = subprocess.run(
                [str(word) for word in command], capture_output=True, text=True, check=False, timeout=20
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"not known: {error}"
        return (done.stdout or done.stderr).strip()

    checkout = Path(__file__).resolve().parents[2]
    return {
        "ignis": said(binary("lio_replay"), "--version"),
        "commit": said("git", "-c", f"safe.directory={checkout}", "-C", checkout, "describe", "--always", "--dirty"),
        "system": platform.platform(),
        "machine": platform.machine(),
        "distribution": platform.freedesktop_os_release().get("PRETTY_NAME", ""),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in _PACKAGES},
        "rmem_max": _first_line(Path("/proc/sys/net/core/rmem_max")),
    }


def _first_line(path: Path) -> str:
    return path.read_text(encoding="ascii").strip() if path.is_file() else "not known"


def _add_run(made: Bundle, run: Path) -> None:
    for name in _RUN_FILES:
        if (run / name).is_file():
            made.add_file(name, run / name, "as the run left it")
    for path in sorted(run.glob(_PROGRAM_LOGS)):
        made.add_file(f"logs/{path.name}", path, "what the process printed (its last MB)")


def _add_log(made: Bundle, log: Path, seconds: float) -> None:
    damage = LogDamage()
    newest = max((event.utime for event in read_events(log, damage)), default=0)
    kept: list[LogEvent] = []
    counts: Counter[str] = Counter()
    for event in read_events(log):
        counts[event.channel] += 1
        if event.utime >= newest - round(seconds * 1e6):
            kept.append(event)
    cut = io.BytesIO()
    writer = LogWriter.to_stream(cut)
    for event in kept:
        writer.write(event.utime, event.channel, event.data)
    made.add_bytes(f"last_{seconds:.0f}_s.lcmlog", cut.getvalue(), f"end of {log.name}; ./ignis replay reads it")
    config = recorded_config(log)
    if config is not None:
        made.add_json("config_in_log.json", config, "configuration recorded in the log")
    made.add_json(
        "counters.json", _counters(log, counts, damage), "messages per channel, newest status of each process"
    )


def _counters(log: Path, counts: Counter[str], damage: LogDamage) -> dict[str, Any]:
    newest: dict[str, Any] = {}
    for _, channel, message in read_log(log, ("HEALTH", "L1_STATUS", "MAP_STATUS"), damage):
        key = f"{channel} {message.process}" if channel == "HEALTH" else channel
        newest[key] = {name: getattr(message, name) for name in message.__slots__}
    return {
        "log": log.name,
        "bytes": log.stat().st_size,
        "messages": dict(sorted(counts.items())),
        "damaged_bytes": damage.skipped_bytes,
        "newest": newest,
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else str(value)


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="./ignis bundle", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "source", type=Path, metavar="RUN|LOG", help="results folder of a replay or demo, or an LCM log"
    )
    parser.add_argument("-o", "--output", type=Path, help="archive (default: ignis-bundle-NAME.tar.gz)")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the log's end (60)")
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)

    def body() -> None:
        if not 0.0 < parsed.seconds <= 3600.0:
            raise InputError(f"--seconds {parsed.seconds:g}: allowed is more than 0 and at most 3600")
        if not parsed.source.exists():
            raise InputError(f"{parsed.source} does not exist")
        path = bundle(parsed.source, parsed.output, parsed.seconds)
        print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
