# SPDX-License-Identifier: Apache-2.0
"""`./ignis evaluate`: accuracy, honesty and cost of the pipeline over scenes and seeds, one row a drive.

With `--variant NAME:section.key=value,...` (repeated) every drive is replayed once more for each variant: an ablation.
"""

import argparse
import concurrent.futures
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ignis.errors import EXIT_DAMAGED, InputError, run_command, run_quietly
from ignis.evaluation.consistency import BAND, SIGMAS, band, inside_percent, nees_of, nis_of, silent_percent
from ignis.evaluation.drives import Simulation, simulated
from ignis.files import write_text
from ignis.mounts import refuse_mounts
from ignis.poses import read_tum
from ignis.run_folder import losses_in, read_json
from ignis.trajectory_error import errors_of, paired

_CHECKOUT = Path(os.environ.get("IGNIS_CHECKOUT", "."))
_SCENES = ("battery_hall", "trees_side_room", "identical_rooms", "corridor", "open_hall_ramp")
_COLUMNS = (
    ("ate_m", "ATE m", "{:.3f}"),
    ("smoothed_ate_m", "smoothed", "{:.3f}"),
    ("rpe_10m_m", "RPE/10 m", "{:.3f}"),
    ("drift_percent", "drift %", "{:.2f}"),
    ("nees_position", "NEES pos.", "{:.2f}"),
    ("nees_attitude", "NEES att.", "{:.2f}"),
    ("nis", "NIS", "{:.2f}"),
    ("inside_percent", f"in {SIGMAS:.0f} sigma %", "{:.1f}"),
    ("silent_percent", "silent %", "{:.1f}"),
    ("applied_percent", "applied %", "{:.1f}"),
    ("named_percent", "named %", "{:.1f}"),
    ("loops", "loops", "{:d}"),
    ("scan_p50_ms", "ms p50", "{:.2f}"),
    ("scan_p99_ms", "ms p99", "{:.2f}"),
)


@dataclass(frozen=True)
class Variant:
    """A change of the configuration under a name."""

    name: str
    changes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """One replay of one drive."""

    simulation: Simulation
    variant: Variant
    figures: dict[str, Any]
    problem: str = ""  # why there are no figures


def _row(simulation: Simulation, variant: Variant, config: Path, folder: Path, binaries: Path) -> Row:
    """A drive that cannot be scored, such as one that never started, is a result too."""
    try:
        return _replay(simulation, variant, config, folder, binaries)
    except InputError as error:
        return Row(simulation, variant, {}, str(error))


def _replay(simulation: Simulation, variant: Variant, config: Path, folder: Path, binaries: Path) -> Row:
    out = folder / f"{simulation.name}_{variant.name}"
    command = [binaries / "lio_replay", simulation.log, "--config", config, "--out", out]
    for change in variant.changes:
        command += ["--set", change]
    run_quietly(command, (0, EXIT_DAMAGED))
    report = read_json(out / "report.json")
    if losses := losses_in(report):
        print(f"WARNING: {simulation.log}: {losses}", file=sys.stderr, flush=True)
    truth = read_tum(simulation.truth)
    eskf = errors_of(paired(read_tum(out / "eskf.tum"), truth), per_scan=False)
    smoothed = errors_of(paired(read_tum(out / "smoothed.tum"), truth), per_scan=False)
    position, attitude = nees_of(out, truth)
    figures = {
        "ate_m": eskf["ate_rmse_m"],
        "smoothed_ate_m": smoothed["ate_rmse_m"],
        "rpe_10m_m": eskf["rpe_10m_rmse_m"],
        "drift_percent": eskf["end_error_percent"],
        "nees_position": position,
        "nees_attitude": attitude,
        "nis": nis_of(out),
        "inside_percent": inside_percent(out, truth),
        "silent_percent": silent_percent(out, truth),
        "applied_percent": 100.0 * report["scans_applied"] / report["scans"],
        "named_percent": 100.0 * report["scans_with_unobserved_directions"] / report["scans"],
        "loops": report["loops_kept"],
        "scan_p50_ms": report["timing"]["scan_p50_ms"],
        "scan_p99_ms": report["timing"]["scan_p99_ms"],
    }
    return Row(simulation, variant, figures)


def _cells(row: Row) -> str:
    if row.problem:
        return " | ".join([f"failed: {row.problem}", *[""] * (len(_COLUMNS) - 1)])
    return " | ".join("" if row.figures[key] is None else form.format(row.figures[key]) for key, _, form in _COLUMNS)


def table(rows: list[Row]) -> str:
    """Markdown: every drive, then per variant and scene the mean over the seeds of the normalised errors."""
    lines = ["| scene, seed | variant | " + " | ".join(title for _, title, _ in _COLUMNS) + " |"]
    lines += ["|---" * (len(_COLUMNS) + 2) + "|"]
    ordered = sorted(rows, key=lambda row: (row.simulation.scene, row.simulation.seed))
    lines += [
        f"| {row.simulation.scene}, {row.simulation.seed} | {row.variant.name} | {_cells(row)} |" for row in ordered
    ]
    lines += ["", f"Mean NEES per degree of freedom over the seeds, and its {100 * BAND:.0f} % band:", ""]
    lines += ["| scene | variant | position | attitude | band |", "|---|---|---|---|---|"]
    groups = dict.fromkeys((row.simulation.scene, row.variant.name) for row in ordered)
    for scene, variant in groups:
        group = [
            row.figures
            for row in ordered
            if (row.simulation.scene, row.variant.name) == (scene, variant) and not row.problem
        ]
        if not group:
            continue
        low, high = band(3 * len(group))
        mean = {key: sum(f[key] for f in group) / len(group) for key in ("nees_position", "nees_attitude")}
        lines.append(
            f"| {scene} | {variant} | {mean['nees_position']:.2f} | {mean['nees_attitude']:.2f} "
            f"| {low:.2f} to {high:.2f} |"
        )
    return "\n".join(lines) + "\n"


def _write(rows: list[Row], folder: Path) -> None:
    write_text(folder / "evaluation.md", table(rows))
    plain = [
        {"scene": row.simulation.scene, "seed": row.simulation.seed, "variant": row.variant.name}
        | (row.figures or {"problem": row.problem})
        for row in rows
    ]
    write_text(folder / "evaluation.json", json.dumps(plain, indent=2) + "\n")


def evaluate(arguments: argparse.Namespace) -> int:
    """Simulates and replays everything; both tables are written anew after each drive. 1 when a replay failed."""
    missing = [name for name in arguments.scenes if not (arguments.scene_folder / f"{name}.json").is_file()]
    if missing:
        raise InputError(f"no such scene: {', '.join(missing)}")
    binaries = Path(os.environ["IGNIS_BUILD"]) / "bin"
    variants = arguments.variant or [Variant("as configured")]
    refuse_mounts([change for variant in variants for change in variant.changes])
    drives = [(scene, seed) for seed in arguments.seeds for scene in arguments.scenes]
    rows: list[Row] = []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:

        def run(drive: tuple[str, int]) -> list[Row]:
            scene = arguments.scene_folder / f"{drive[0]}.json"
            inputs = arguments.out / "inputs"
            simulation = simulated(binaries / "l1_sim", scene, drive[1], arguments.config, arguments.scene_set, inputs)
            return [_row(simulation, v, arguments.config, arguments.out / "runs", binaries) for v in variants]

        for done in concurrent.futures.as_completed([pool.submit(run, drive) for drive in drives]):
            for row in done.result():
                rows.append(row)
                result = row.problem or f"ATE {row.figures['ate_m']:.3f} m"
                print(
                    f"evaluate: {len(rows)} of {len(drives) * len(variants)}: {row.simulation.name} "
                    f"{row.variant.name}: {result}",
                    flush=True,
                )
            _write(rows, arguments.out)
    print(f"\n{table(rows)}\n{arguments.out / 'evaluation.md'}")
    return 1 if any(row.problem for row in rows) else 0


def _variant(text: str) -> Variant:
    name, colon, changes = text.partition(":")
    if not name or not colon:
        raise argparse.ArgumentTypeError("write NAME:section.key=value, with commas between several")
    return Variant(name, tuple(change for change in changes.split(",") if change))


def _seeds(text: str) -> list[int]:
    first, dash, last = text.partition("-")
    try:
        return list(range(int(first), int(last) + 1)) if dash else [int(word) for word in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError("write 1-5 or 1,3,7") from None


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis evaluate", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--scenes", type=lambda text: text.split(","), default=list(_SCENES), help="names in the scene folder"
    )
    parser.add_argument("--scene-folder", type=Path, default=_CHECKOUT / "config" / "scenes")
    parser.add_argument("--seeds", type=_seeds, default=[1, 2, 3], help="1-5 or 1,3,7 (default 1-3)")
    parser.add_argument("--config", type=Path, default=_CHECKOUT / "config" / "ignis8_tuned.json")
    parser.add_argument("--variant", type=_variant, action="append", help="NAME:section.key=value,...; repeatable")
    parser.add_argument(
        "--scene-set", action="append", default=[], help="section.key=value in every scene; repeatable", metavar="K=V"
    )
    parser.add_argument("--jobs", type=int, default=1, help="drives at the same time (times per scan suffer)")
    parser.add_argument("--out", type=Path, default=Path("results/evaluation"))
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)
    if parsed.jobs < 1:
        parser.error("--jobs: at least 1")
    return run_command(lambda: evaluate(parsed))


if __name__ == "__main__":
    sys.exit(main())
