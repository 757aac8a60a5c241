# SPDX-License-Identifier: Apache-2.0
"""`./ignis export`: a log or the results of a replay, for other tools.

mcap: Foxglove schemas; ros2: a bag that can be imported again; both in axes of ROS. tum, csv, g2o: plain files.
What a log of sensor data does not hold (trajectories, graph) is computed by a replay.
"""

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ignis import results
from ignis.errors import EXIT_DAMAGED, InputError, run_command
from ignis.exporters.log_feed import feed_log
from ignis.exporters.mcap_sink import McapSink
from ignis.exporters.plain import write_log_tables, write_run_tables, write_trajectories
from ignis.exporters.ros2_sink import Ros2Sink
from ignis.exporters.run_feed import feed_run
from ignis.exporters.sink import Sink
from ignis.files import replacing
from ignis.importing import ImportChoice, detect
from ignis.log_config import recorded_config
from ignis.poses import Trajectory, make_trajectory
from ignis.replay import replay
from ignis.run_folder import Run, is_run, read_run

_SUFFIX = {"mcap": ".mcap", "ros2": "_ros2", "tum": "_tum", "csv": "_csv", "g2o": ".g2o"}


def export(source: Path, form: str, output: Path | None, in_ros_axes: bool = False) -> list[Path]:
    """Writes one format; returns what was written."""
    run = read_run(source) if is_run(source) else None
    if run is None and detect(source) != "lcm":
        raise InputError(f"{source} is neither an LCM log nor the folder of a replay; ./ignis import makes logs")
    if in_ros_axes and form != "tum":
        raise InputError("--axes belongs to --to tum; mcap and ros2 are in axes of ROS, csv and g2o in ours")
    out = output or source.with_name(source.resolve().name.removesuffix(".lcmlog") + _SUFFIX[form])
    if form == "mcap":
        return _to_mcap(source, run, out)
    if form == "ros2":
        return _to_ros2(source, run, out)
    if form == "csv":
        return write_run_tables(run, out) if run else write_log_tables(source, out)
    if form == "tum":
        with _trajectories(source, run) as trajectories:
            return write_trajectories(trajectories, out, in_ros_axes)
    with _as_run(source, run) as replayed, replacing(out) as temporary:
        shutil.copyfile(replayed.folder / "keyframes.g2o", temporary)
    return [out]


def _feed(source: Path, run: Run | None, sink: Sink) -> None:
    feed_run(run, sink) if run else feed_log(source, sink)


def _to_mcap(source: Path, run: Run | None, out: Path) -> list[Path]:
    with replacing(out) as temporary:
        with temporary.open("wb") as stream:
            sink = McapSink(stream)
            _feed(source, run, sink)
            sink.finish()
        _tell(sink.counts, source, run)
    return [out]


def _to_ros2(source: Path, run: Run | None, out: Path) -> list[Path]:
    if out.exists():
        raise InputError(f"{out} exists; a bag is a folder of its own, choose another name with -o")
    partial = out.with_name(out.name + ".tmp")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        with Ros2Sink(partial) as sink:
            _feed(source, run, sink)
        _tell(sink.counts, source, run)
        # The bag's files are named after its folder, and metadata.yaml names the files: rewritten for the final name.
        _rename_bag(partial, out)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return [out]


def _rename_bag(partial: Path, out: Path) -> None:
    for file in partial.glob(f"{partial.name}*"):
        file.rename(partial / file.name.replace(partial.name, out.name))
    metadata = partial / "metadata.yaml"
    metadata.write_text(metadata.read_text(encoding="utf-8").replace(partial.name, out.name), encoding="utf-8")
    partial.rename(out)


def _tell(counts: Counter[str], source: Path, run: Run | None) -> None:
    for topic, count in sorted(counts.items()):
        print(f"  {topic:22}{count:8} messages")
    if run is None and "/lio/pose" not in counts:
        print(f"  no poses: {source.name} holds sensor data alone; replay it and export the run to have them")
    if run is not None and run.log is None:
        print(f"  no scans: the log {run.report['log']} of this run no longer lies where it was")


@contextmanager
def _as_run(source: Path, run: Run | None) -> Iterator[Run]:
    """The run itself, or a replay of the log that lasts as long as the block."""
    if run is not None:
        yield run
        return
    if recorded_config(source) is None:
        raise InputError(
            f"{source} holds no configuration, so a replay of it would be a guess: first ./ignis replay {source} "
            "--config CFG --out RUN, then export RUN"
        )
    with tempfile.TemporaryDirectory(prefix="ignis-export-") as folder:
        code = replay(source, Path(folder), None, ImportChoice(), [], page=False)
        if code not in (0, EXIT_DAMAGED):
            raise InputError(f"{source} could not be replayed")
        yield read_run(Path(folder))


@contextmanager
def _trajectories(source: Path, run: Run | None) -> Iterator[dict[str, Trajectory]]:
    content = None if run else results.read_run(source)
    if content is not None and content.scan_stats:
        eskf = results.eskf_trajectory(content)
        found = {"eskf": eskf, "smoothed": results.smoothed_trajectory(content, eskf)}
        yield found | ({"ground_truth": make_trajectory(content.truth).at(eskf.utime)} if content.truth else {})
        return
    with _as_run(source, run) as replayed:
        found = {"eskf": replayed.eskf, "smoothed": replayed.smoothed}
        yield found | ({"ground_truth": replayed.truth} if replayed.truth is not None else {})


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="./ignis export", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", type=Path, metavar="LOG|RUN", help="LCM log, or results folder of a replay")
    parser.add_argument("--to", choices=list(_SUFFIX), required=True, help="format")
    parser.add_argument("-o", "--output", type=Path, help="file or folder to write (default: beside the source)")
    parser.add_argument("--axes", choices=("ours", "forward_left_up"), default="ours", help="of --to tum")
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)

    def body() -> None:
        written = export(parsed.source, parsed.to, parsed.output, parsed.axes == "forward_left_up")
        print(f"wrote {', '.join(str(path) for path in written)}")

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
