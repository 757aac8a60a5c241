# SPDX-License-Identifier: Apache-2.0
"""`./ignis sweep`: many replays over parameters and logs, one table.

Locally in processes, or on the workers of a Dask cluster that see the same files (start them with `./ignis shell dask
worker ADDRESS`). A second start goes on where the first was interrupted; a failed replay is a row like the others.
"""

import argparse
import hashlib
import sys
import time
from pathlib import Path

from ignis.errors import EXIT_FAILURE, InputError, run_command
from ignis.importing import detect
from ignis.replay import lio_replay
from ignis.sweeping.engines import run_locally, run_on_dask
from ignis.sweeping.grid import Task, combinations, parse_axes, refuse_bad_combinations, tasks_of
from ignis.sweeping.outcome import write_outcome
from ignis.sweeping.task import Row, finished_row

# The table and the page are written anew this often while replays end.
_WRITE_PERIOD_S = 10.0


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./ignis sweep", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("logs", type=Path, nargs="+", metavar="LOG", help="LCM logs; truth inside, or LOG.tum beside")
    parser.add_argument("--config", type=Path, required=True, help="configuration that the values are set in")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=A,B,C", help="values of one parameter")
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder for the table and the runs")
    parser.add_argument("--engine", choices=("local", "dask"), default="local")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, for example tcp://10.0.0.5:8786")
    parser.add_argument("--jobs", type=int, help="replays at the same time, with --engine local (1)")
    parser.add_argument("--no-loops", action="store_true", help="leave out loop closing")
    parser.add_argument("--until", type=float, help="end each replay so many seconds behind its start")
    return parser.parse_args(arguments)


def sweep(options: argparse.Namespace) -> int:
    """Runs what is not there yet; returns 1 when a replay failed."""
    axes = parse_axes(options.set)
    _refuse_bad_options(options)
    chosen = combinations(axes)
    refuse_bad_combinations(lio_replay().with_name("lio_frontend"), options.config, chosen)
    flags = (["--no-loops"] if options.no_loops else []) + (["--until", f"{options.until:g}"] if options.until else [])
    build = hashlib.sha256(lio_replay().read_bytes()).hexdigest()
    options.out.mkdir(parents=True, exist_ok=True)
    tasks = tasks_of(options.logs, options.config, chosen, tuple(flags), options.out, build)
    rows = {task.folder: row for task in tasks if (row := finished_row(task)) is not None}
    waiting = [task for task in tasks if task.folder not in rows]
    if rows:
        print(f"sweep: {len(rows)} of {len(tasks)} replays are there from before", flush=True)
    began = write_at = time.monotonic()
    results = (
        run_on_dask(waiting, options.scheduler) if options.engine == "dask" else run_locally(waiting, options.jobs or 1)
    )
    for done, (task, row) in enumerate(results if waiting else [], start=1):
        rows[task.folder] = row
        left = (time.monotonic() - began) / done * (len(waiting) - done)
        print(f"sweep: {len(rows)} of {len(tasks)}, {left:.0f} s left: {task.title}: {_outcome(row)}", flush=True)
        if time.monotonic() > write_at:
            write_outcome(options.out, tasks, rows, list(axes))
            write_at = time.monotonic() + _WRITE_PERIOD_S
    write_outcome(options.out, tasks, rows, list(axes))
    return _report(options.out, tasks, rows)


def _refuse_bad_options(options: argparse.Namespace) -> None:
    if (options.engine == "dask") != (options.scheduler is not None):
        raise InputError("--engine dask and --scheduler ADDRESS belong together")
    if options.jobs is not None and (options.engine == "dask" or not 1 <= options.jobs <= 1024):
        raise InputError(f"--jobs {options.jobs}: allowed is 1 to 1024, with --engine local")
    if options.until is not None and options.until <= 0.0:
        raise InputError(f"--until {options.until:g}: allowed is more than 0 s")
    if not options.config.is_file():
        raise InputError(f"cannot read the configuration {options.config}: no such file")
    names = [log.stem for log in options.logs]
    if len(set(names)) != len(names):
        raise InputError("two logs have the same name, which names their rows; rename one")
    for log in options.logs:
        if detect(log) != "lcm":
            raise InputError(f"{log} is no LCM log; ./ignis import makes one of it")


def _outcome(row: Row) -> str:
    if row["status"] != "ok":
        return f"FAILED: {row['failure']}"
    if row.get("eskf_ate_rmse_m") is None:
        return f"{row['scans_applied']} of {row['scans']} scans applied"
    return f"ATE {row['eskf_ate_rmse_m']:.3f} m ESKF only, {row['smoothed_ate_rmse_m']:.3f} m smoothed"


def _report(out: Path, tasks: list[Task], rows: dict[str, Row]) -> int:
    failed = [task for task in tasks if rows[task.folder]["status"] != "ok"]
    print(f"wrote {out / 'table.parquet'}, {out / 'table.csv'}, {out / 'timing.csv'} and {out / 'sweep.html'}")
    for task in failed:
        print(f"ignis: failed: {task.title}: {rows[task.folder]['failure']}", file=sys.stderr)
    if failed:
        print(f"ignis: {len(failed)} of {len(tasks)} replays failed; starting again tries these again", file=sys.stderr)
        return EXIT_FAILURE
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parsed = _parse(sys.argv[1:] if arguments is None else arguments)
    return run_command(lambda: sweep(parsed))


if __name__ == "__main__":
    sys.exit(main())
