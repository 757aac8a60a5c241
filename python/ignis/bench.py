# SPDX-License-Identifier: Apache-2.0
"""`./ignis bench`: ours and the peers over the same simulated drives, on the same core, in one table."""

import argparse
import json
import os
import platform
import statistics
import sys
from pathlib import Path
from typing import Any

from ignis.benching.inputs import Drive, make_drive
from ignis.benching.systems import OURS, PEERS, Outcome, peers_python, run_ours, run_peer
from ignis.errors import InputError, run_command
from ignis.files import write_text

_CHECKOUT = Path(os.environ.get("IGNIS_CHECKOUT", "."))
_SCENES = ("battery_hall", "trees_side_room", "identical_rooms", "corridor", "corridor_bare", "open_hall_ramp")
_QUICK_SCENES = ("battery_hall_quick",)
_COLUMNS = (
    ("ate_rmse_m", "ATE m", "{:.3f}"),
    ("rpe_10m_rmse_m", "RPE/10 m", "{:.3f}"),
    ("end_error_m", "end m", "{:.3f}"),
    ("scan_median_ms", "ms p50", "{:.2f}"),
    ("scan_p99_ms", "ms p99", "{:.2f}"),
    ("cpu_s", "CPU s", "{:.1f}"),
    ("peak_mb", "peak MB", "{:.0f}"),
)


def _median(outcomes: list[Outcome], key: str) -> float | None:
    values = [outcome.figures.get(key) for outcome in outcomes]
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def table(outcomes: list[Outcome]) -> str:
    """Markdown: medians over the seeds, and the ratio of ATE to the best peer's."""
    lines = []
    for scene in dict.fromkeys(outcome.drive.scene for outcome in outcomes):
        here = [outcome for outcome in outcomes if outcome.drive.scene == scene]
        seeds = len({outcome.drive.seed for outcome in here})
        lines += [f"### {scene} ({seeds} seed{'s' if seeds > 1 else ''})", ""]
        lines += ["| system | " + " | ".join(title for _, title, _ in _COLUMNS) + " | ATE / best peer |"]
        lines += ["|---" * (len(_COLUMNS) + 2) + "|"]
        by_system = {name: [o for o in here if o.system == name] for name in (*OURS, *PEERS)}
        peers = [_median(by_system[name], "ate_rmse_m") for name in PEERS]
        best = min((ate for ate in peers if ate is not None), default=None)
        for name, group in by_system.items():
            if group:
                lines.append(f"| {name} | " + " | ".join(_cells(group, best)) + " |")
        lines.append("")
    return "\n".join(lines)


def _cells(group: list[Outcome], best: float | None) -> list[str]:
    failed = [outcome.figures["failed"] for outcome in group if "failed" in outcome.figures]
    if len(failed) == len(group):
        return [f"failed: {failed[0]}"] + [""] * len(_COLUMNS)
    medians = [(_median(group, key), form) for key, _, form in _COLUMNS]
    cells = ["" if value is None else form.format(value) for value, form in medians]
    ate = _median(group, "ate_rmse_m")
    return [*cells, "" if ate is None or best is None else f"{ate / best:.2f}"]


def _machine(peers_versions: str) -> str:
    cpu = next((line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")), "")
    return (
        f"{cpu.partition(':')[2].strip()}, {os.cpu_count()} cores, Linux {platform.release()}; every system on one "
        f"thread of the same core, one at a time; medians over seeds. Peers: {peers_versions}, with the settings in "
        "python/ignis/benching/peer_runner.py: ours, not their authors'. One that fails may do better with others."
    )


def bench(arguments: argparse.Namespace) -> int:
    """Runs everything; writes bench.md and bench.json as it goes, so that an interrupted run keeps what it has."""
    build = Path(os.environ["IGNIS_BUILD"]) / "bin"
    config = arguments.config
    requirements = _CHECKOUT / "packaging" / "peer-requirements.txt"
    cache = Path(os.environ.get("IGNIS_CACHE", Path.home() / ".cache" / "ignis"))
    python = peers_python(requirements, cache) if arguments.peers else None
    versions = ", ".join(line for line in requirements.read_text().splitlines() if line and not line.startswith("#"))
    arguments.out.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    for scene in arguments.scenes:
        path = _CHECKOUT / "config" / "scenes" / f"{scene}.json"
        if not path.is_file():
            raise InputError(f"there is no scene {path}")
        for seed in range(1, arguments.seeds + 1):
            print(f"bench: {scene}, seed {seed}: simulating", flush=True)
            drive = make_drive(build / "l1_sim", path, seed, config, arguments.out / "inputs")
            for outcome in _run_all(build, drive, config, python, arguments):
                outcomes.append(outcome)
                print(f"bench:   {outcome.system}: {_short(outcome.figures)}", flush=True)
            _write(arguments.out, outcomes, _machine(versions))
    print(f"\n{table(outcomes)}\n{arguments.out / 'bench.md'}")
    return 0


def _run_all(build: Path, drive: Drive, config: Path, python: Path | None, arguments: argparse.Namespace):
    out = arguments.out / "runs" / f"{drive.scene}_{drive.seed}"
    yield from run_ours(build / "lio_replay", drive, config, out / "ours", arguments.core)
    for name in arguments.peers:
        yield run_peer(python, name, drive, out / name, arguments.core)


def _short(figures: dict[str, Any]) -> str:
    if "failed" in figures:
        return f"failed, {figures['failed']}"
    return (
        f"ATE {figures['ate_rmse_m']:.3f} m, {figures['scan_median_ms']:.2f} ms per scan, {figures['cpu_s']:.1f} s CPU"
    )


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
        "--scenes", type=lambda text: text.split(","), help="names in config/scenes, with commas between"
    )
    parser.add_argument("--seeds", type=int, default=1, help="seeds per scene (default 1)")
    parser.add_argument("--peers", type=_names(PEERS), default=list(PEERS), help="with commas between; '' for none")
    parser.add_argument("--config", type=Path, default=_CHECKOUT / "config" / "ignis8_tuned.json")
    parser.add_argument("--core", type=int, default=os.cpu_count() - 1, help="the core that every system runs on")
    parser.add_argument("--out", type=Path, default=Path("results/bench"))
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)
    parsed.scenes = parsed.scenes or list(_QUICK_SCENES if parsed.quick else _SCENES)
    return run_command(lambda: bench(parsed))


if __name__ == "__main__":
    sys.exit(main())
