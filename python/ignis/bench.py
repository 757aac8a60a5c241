# SPDX-License-Identifier: Apache-2.0
"""`./ignis bench`: ours and the peers over the same drives, on the same core, in one table.

Simulated drives (--scenes, --seeds), or a recording (--recording). Without ground truth of that, how far its end is
from its start is told instead of errors, which is one where the vehicle came back.
"""

import argparse
import json
import os
import platform
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ignis.benching.inputs import Drive, make_drive, recorded_drive, sensor_of
from ignis.benching.systems import OURS, PEERS, Outcome, peers_python, run_ours, run_peer
from ignis.comparing.estimates import AXES
from ignis.errors import InputError, run_command
from ignis.files import write_text

_CHECKOUT = Path(os.environ.get("IGNIS_CHECKOUT", "."))
_SCENES = (
    "battery_hall",
    "trees_side_room",
    "identical_rooms",
    "corridor",
    "corridor_bare",
    "open_hall_ramp",
    "hall_spinning64",
    "street_spinning64",
    "warehouse_spinning128",
)
_QUICK_SCENES = ("battery_hall_quick",)
_COLUMNS = (
    ("ate_rmse_m", "ATE m", "{:.3f}"),
    ("rpe_10m_rmse_m", "RPE/10 m", "{:.3f}"),
    ("end_error_m", "end m", "{:.3f}"),
    ("end_to_start_m", "end to start m", "{:.3f}"),
    ("scan_p50_ms", "ms p50", "{:.2f}"),
    ("scan_p99_ms", "ms p99", "{:.2f}"),
    ("cpu_s", "CPU s", "{:.1f}"),
    ("peak_mb", "peak MB", "{:.0f}"),
)


def _median(outcomes: list[Outcome], key: str) -> float | None:
    values = [outcome.figures.get(key) for outcome in outcomes]
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def table(outcomes: list[Outcome]) -> str:
    """Markdown: medians over the seeds, and the ratios of ATE and CPU time to those of the best peer in each."""
    lines = []
    for scene in dict.fromkeys(outcome.drive.scene for outcome in outcomes):
        here = [outcome for outcome in outcomes if outcome.drive.scene == scene]
        seeds = len({outcome.drive.seed for outcome in here})
        drawn = "recording" if here[0].drive.seed is None else f"{seeds} seed{'s' if seeds > 1 else ''}"
        lines += [f"### {scene} ({drawn})", ""]
        columns = [each for each in _COLUMNS if any(each[0] in outcome.figures for outcome in here)] or [_COLUMNS[0]]
        titles = [title for _, title, _ in columns]
        lines += ["| system | " + " | ".join(titles) + " | ATE / best peer | CPU / fastest peer |"]
        lines += ["|---" * (len(columns) + 3) + "|"]
        by_system = {name: [o for o in here if o.system == name] for name in (*OURS, *PEERS)}
        peers = [outcome for name in PEERS for outcome in by_system[name]]
        for name, group in by_system.items():
            if group:
                lines.append(f"| {name} | " + " | ".join(_cells(group, peers, columns)) + " |")
        lines.append("")
    return "\n".join(lines)


def _cells(group: list[Outcome], peers: list[Outcome], columns: list[tuple[str, str, str]]) -> list[str]:
    failed = [outcome.figures["failed"] for outcome in group if "failed" in outcome.figures]
    if len(failed) == len(group):
        return [f"failed: {failed[0]}"] + [""] * (len(columns) + 1)
    medians = [(_median(group, key), form) for key, _, form in columns]
    cells = ["" if value is None else form.format(value) for value, form in medians]
    if failed:
        cells[0] += f" ({len(failed)} of {len(group)} failed: {failed[0]})"
    return [*cells, _ratio(group, peers, "ate_rmse_m"), _ratio(group, peers, "cpu_s")]


def _ratio(group: list[Outcome], peers: list[Outcome], key: str) -> str:
    """Of a median to the least median among the peers."""
    by_peer = [_median([each for each in peers if each.system == name], key) for name in PEERS]
    best = min((value for value in by_peer if value is not None), default=None)
    value = _median(group, key)
    return "" if not value or not best else f"{value / best:.2f}"


def _machine(peers_versions: str) -> str:
    cpu = next((line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")), "")
    return (
        f"{cpu.partition(':')[2].strip()}, {os.cpu_count()} cores, Linux {platform.release()}; every system on one "
        "thread of the same core, one at a time; medians over seeds. CPU seconds are those of the odometry (ours: the "
        "front end's stage; ours, smoothed: the whole process with back end and map), milliseconds those of a scan of "
        "the sensor. Peers: "
        f"{peers_versions}, with the settings in python/ignis/benching/peer_runner.py: ours, not their authors'. One "
        "that fails may do better with others."
    )


def bench(arguments: argparse.Namespace) -> int:
    """Runs everything; writes bench.md and bench.json as it goes, so that an interrupted run keeps what it has."""
    build = Path(os.environ["IGNIS_BUILD"]) / "bin"
    requirements = _CHECKOUT / "packaging" / "peer-requirements.txt"
    cache = Path(os.environ.get("IGNIS_CACHE", Path.home() / ".cache" / "ignis"))
    python = peers_python(requirements, cache) if arguments.peers else None
    versions = ", ".join(line for line in requirements.read_text().splitlines() if "==" in line)
    arguments.out.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    drives = _recorded(arguments) if arguments.recording else _simulated(build / "l1_sim", arguments)
    for drive, config in drives:
        for outcome in _run_all(build, drive, config, python, arguments):
            outcomes.append(outcome)
            print(f"bench:   {outcome.system}: {_short(outcome.figures)}", flush=True)
        _write(arguments.out, outcomes, _machine(versions))
    print(f"\n{table(outcomes)}\n{arguments.out / 'bench.md'}")
    return 0


def _recorded(arguments: argparse.Namespace) -> Iterator[tuple[Drive, Path]]:
    if arguments.config is None:
        raise InputError("--recording needs --config, with the mounts of its sensors")
    print(f"bench: {arguments.recording}: reading", flush=True)
    drive = recorded_drive(
        arguments.recording, arguments.config, arguments.gt, arguments.gt_axes, arguments.out / "inputs"
    )
    yield drive, arguments.config


def _simulated(l1_sim: Path, arguments: argparse.Namespace) -> Iterator[tuple[Drive, Path]]:
    configs = {
        "l1": arguments.config or _CHECKOUT / "config" / "ignis8_tuned.json",
        "spinning": arguments.spinning_config,
    }
    runs = [(path, seed) for path in _scene_files(arguments) for seed in _seeds(arguments)]
    for number, (path, seed) in enumerate(runs, 1):
        print(f"bench: {number} of {len(runs)}: {path.stem}, seed {seed}: simulating", flush=True)
        config = configs[sensor_of(path)]
        yield make_drive(l1_sim, path, seed, config, arguments.out / "inputs"), config


def _seeds(arguments: argparse.Namespace) -> range:
    return range(arguments.first_seed, arguments.first_seed + arguments.seeds)


def _scene_files(arguments: argparse.Namespace) -> list[Path]:
    paths = [arguments.scene_folder / f"{scene}.json" for scene in arguments.scenes]
    missing = [str(path) for path in paths if not path.is_file()]
    if missing:
        raise InputError(f"there is no scene {', '.join(missing)}")
    return paths


def _run_all(build: Path, drive: Drive, config: Path, python: Path | None, arguments: argparse.Namespace):
    out = arguments.out / "runs" / f"{drive.scene}_{drive.seed}"
    yield from run_ours(build / "lio_replay", drive, config, out / "ours", arguments.core)
    if python is None:
        return
    for name in arguments.peers:
        yield run_peer(python, name, drive, out / name, arguments.core)


def _short(figures: dict[str, Any]) -> str:
    if "failed" in figures:
        return f"failed, {figures['failed']}"
    key, what = ("ate_rmse_m", "ATE") if "ate_rmse_m" in figures else ("end_to_start_m", "end to start")
    return f"{what} {figures[key]:.3f} m, {figures['scan_p50_ms']:.2f} ms per scan, {figures['cpu_s']:.1f} s CPU"


def _write(out: Path, outcomes: list[Outcome], machine: str) -> None:
    rows = [{"system": o.system, "scene": o.drive.scene, "seed": o.drive.seed} | o.figures for o in outcomes]
    write_text(out / "bench.json", json.dumps(rows, indent=2) + "\n")
    write_text(out / "bench.md", f"{machine}\n\n{table(outcomes)}")


def _names(choices: tuple[str, ...]):
    def parse(text: str) -> list[str]:
        names = [name for name in text.split(",") if name]
        wrong = [name for name in names if name not in choices]
        if wrong:
            raise argparse.ArgumentTypeError(f"{', '.join(wrong)}: choose from {', '.join(choices)}")
        return names

    return parse


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one short drive")
    parser.add_argument(
        "--scenes", type=lambda text: text.split(","), help="names in the scene folder, with commas between"
    )
    parser.add_argument("--seeds", type=int, default=1, help="seeds per scene (default 1)")
    parser.add_argument("--first-seed", type=int, default=1, help="the seeds count from here (default 1)")
    parser.add_argument("--peers", type=_names(PEERS), default=list(PEERS), help="with commas between; '' for none")
    parser.add_argument(
        "--recording", type=Path, help="instead of scenes: a recording of any kind that ./ignis import reads, or a log"
    )
    parser.add_argument(
        "--gt", type=Path, help="its ground truth in TUM format (default: what is recorded in it, if so)"
    )
    parser.add_argument("--gt-axes", choices=AXES, default="auto", help="axes of that ground truth")
    parser.add_argument(
        "--config", type=Path, help="of the recording, or of scenes of an L1 (these: config/ignis8_tuned.json)"
    )
    parser.add_argument("--spinning-config", type=Path, default=_CHECKOUT / "config" / "spinning.json")
    parser.add_argument("--scene-folder", type=Path, default=_CHECKOUT / "config" / "scenes")
    parser.add_argument(
        "--core", type=int, default=(os.cpu_count() or 1) - 1, help="the core that every system runs on"
    )
    parser.add_argument("--out", type=Path, default=Path("results/bench"))
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)
    if parsed.recording and (parsed.scenes or parsed.quick):
        parser.error("--recording takes the place of --scenes and --quick")
    if parsed.gt and not parsed.recording:
        parser.error("--gt belongs to a --recording")
    parsed.scenes = parsed.scenes or list(_QUICK_SCENES if parsed.quick else _SCENES)
    return run_command(lambda: bench(parsed))


if __name__ == "__main__":
    sys.exit(main())
