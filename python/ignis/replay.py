# SPDX-License-Identifier: Apache-2.0
"""`./ignis replay`: the whole pipeline over a recording of any kind, and a page about it.

An LCM log is replayed as it is; a capture, bag, packet capture or KITTI drive is imported first. `lio_replay` does the
work; options that are not listed here (--no-loops, --speed, --until, ...) go to it.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from ignis.errors import EXIT_DAMAGED, EXIT_FAILURE, EXIT_INTERRUPTED, InputError, run_command
from ignis.files import write_text
from ignis.importing import ImportChoice, add_choices, choice_of, detect, import_recording
from ignis.log_config import differences, recorded_config
from ignis.mounts import mounts_among, set_options
from ignis.pages.run_page import write_run_page
from ignis.run_folder import read_run

_IMPORTED_NAME = "input.lcmlog"
_RECORDED_NAME = "recorded_config.json"
_MOST_DIFFERENCES = 6


def lio_replay() -> Path:
    """The built executable."""
    path = Path(os.environ.get("IGNIS_BUILD", ".")) / "bin" / "lio_replay"
    if not path.is_file():
        raise InputError(f"{path} does not exist; run ./ignis build first")
    return path


def replay(
    source: Path, folder: Path, config: Path | None, choice: ImportChoice, options: list[str], page: bool
) -> int:
    """Replays one recording into a folder; returns lio_replay's exit code."""
    folder.mkdir(parents=True, exist_ok=True)
    kind = detect(source)
    log = source
    if kind == "lcm":
        config = _choose_config(source, folder, config)
    else:
        if config is None:
            raise InputError(f"{source} must be imported first: give --config with the mounts of its sensors")
        log = folder / _IMPORTED_NAME
        import_recording(source, log, config, choice)
    elsewhere = mounts_among(choice.changes) if kind == "lcm" else []
    if elsewhere:
        print(f"WARNING: {source} is in the body frame already; no effect has {', '.join(elsewhere)}", file=sys.stderr)
    command = [str(lio_replay()), str(log), "--out", str(folder), *set_options(choice.changes), *options]
    if config is not None:
        command += ["--config", str(config)]
    code = _run_to_the_end(command)
    if code not in (0, EXIT_DAMAGED):
        return code
    _tell_differences(log, folder)
    if page:
        print(f"page:       {write_run_page(read_run(folder))}", flush=True)
    return code


def _choose_config(log: Path, folder: Path, given: Path | None) -> Path | None:
    """The given configuration, else the one inside the log, else none: the built-in defaults."""
    if given is not None:
        return given
    recorded = recorded_config(log)
    if recorded is None:
        print("config:     none given and none in the log: built-in defaults", file=sys.stderr)
        return None
    path = folder / _RECORDED_NAME
    write_text(path, json.dumps(recorded, indent=2) + "\n")
    print("config:     the one recorded in the log", file=sys.stderr, flush=True)
    return path


def _tell_differences(log: Path, folder: Path) -> None:
    recorded = recorded_config(log)
    if recorded is None:
        return
    used = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    # Where the bus was does not change a replay, nor does the page's address.
    found = [key for key in differences(recorded, used) if key.split(".")[0] not in ("lcm", "hmi", "$schema")]
    if found:
        more = f" and {len(found) - _MOST_DIFFERENCES} more" if len(found) > _MOST_DIFFERENCES else ""
        print(f"config:     differs from the recorded one in {', '.join(found[:_MOST_DIFFERENCES])}{more}")


def _run_to_the_end(command: list[str]) -> int:
    """Ctrl-C reaches the program as well, which then writes what it has: wait for it."""
    with subprocess.Popen(command) as process:
        interrupted = False
        while True:
            try:
                code = process.wait()
                break
            except KeyboardInterrupt:
                interrupted = True
                process.terminate()
    if interrupted:
        print("ignis: interrupted; the results reach as far as the replay had come", file=sys.stderr)
        return EXIT_INTERRUPTED
    return code if code >= 0 else EXIT_FAILURE


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="./ignis replay",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("source", type=Path, nargs="?", help="LCM log, L1 capture, bag, MCAP, pcap or KITTI folder")
    parser.add_argument("-o", "--out", type=Path, help="folder for the results")
    parser.add_argument("--config", type=Path, help="configuration; default: the one recorded in the log")
    parser.add_argument("--no-page", action="store_true", help="write no summary.html")
    add_choices(parser)
    words = sys.argv[1:] if arguments is None else arguments
    parsed, options = parser.parse_known_args(words)
    if parsed.source is None and parsed.out is None:
        # --print-config, --version and the like need no log.
        return subprocess.call([str(lio_replay()), *words])

    def body() -> int:
        if parsed.source is None or parsed.out is None:
            raise InputError("give a recording and --out FOLDER; --help shows all options")
        return replay(parsed.source, parsed.out, parsed.config, choice_of(parsed), options, not parsed.no_page)

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
