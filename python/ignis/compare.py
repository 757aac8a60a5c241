# SPDX-License-Identifier: Apache-2.0
"""`./ignis compare`: ESKF-only against smoothed, and others, over one drive or many."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from ignis.comparing.estimates import AXES, Estimates, label_of, read_estimates
from ignis.comparing.figures import ALIGNMENT, aligned, figures_of
from ignis.comparing.gain import gain_of
from ignis.comparing.text_table import run_table, runs_table
from ignis.comparison_plots import plot_errors, plot_trajectories
from ignis.errors import InputError, run_command
from ignis.files import write_text
from ignis.pages.comparison_page import write_comparison_page
from ignis.poses import Trajectory

table = run_table


def comparison(folder: Path, gt: Path | None = None, per_scan: bool = False, gt_axes: str = "auto") -> dict[str, Any]:
    """Compares DIR/eskf.tum and DIR/smoothed.tum; writes compare.json, compare.html, trajectory.png and error.png."""
    result: dict[str, Any] = compare_drives([read_estimates(folder, gt, [], gt_axes)], folder, per_scan)["runs"][0]
    return result


def compare_drives(drives: list[Estimates], out: Path, per_scan: bool) -> dict[str, Any]:
    """Figures of all drives and of the gain; writes compare.json, compare.html and, for one drive, two pictures."""
    runs = [figures_of(drive, per_scan) for drive in drives]
    result = {"alignment": ALIGNMENT, "runs": runs, "smoothing": gain_of(runs)}
    if len(drives) == 1:
        laid = _labelled(aligned(drives[0]))
        plot_trajectories(out / "trajectory.png", laid, drives[0].truth)
        if drives[0].truth is not None:
            plot_errors(out / "error.png", laid, drives[0].truth)
    write_text(out / "compare.json", json.dumps(result, indent=2) + "\n")
    write_comparison_page(out, drives, result)
    return result


def _labelled(trajectories: dict[str, Trajectory]) -> dict[str, Trajectory]:
    return {label_of(name): trajectory for name, trajectory in trajectories.items()}


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis compare", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="RUN", help="results folders, one a drive or seed")
    parser.add_argument("--gt", type=Path, help="ground truth in TUM format; default: ground_truth.tum of each folder")
    parser.add_argument(
        "--against", type=Path, action="append", default=[], metavar="TUM", help="another estimate of the same drive"
    )
    parser.add_argument("--gt-axes", choices=AXES, default="auto", help="axes of ground truth and other estimates")
    parser.add_argument("--per-scan", action="store_true", help="report the relative error from scan to scan as well")
    parser.add_argument(
        "--out", type=Path, help="folder for compare.json and compare.html (default: RUN, or its parent)"
    )
    return parser.parse_args(arguments)


def _compare(parsed: argparse.Namespace) -> None:
    folders: list[Path] = parsed.folders
    if len(folders) > 1 and (parsed.gt or parsed.against):
        raise InputError("--gt and --against belong to one drive; give one RUN with them")
    drives = [read_estimates(folder, parsed.gt, parsed.against, parsed.gt_axes) for folder in folders]
    out = parsed.out or (folders[0] if len(folders) == 1 else folders[0].resolve().parent)
    out.mkdir(parents=True, exist_ok=True)
    result = compare_drives(drives, out, parsed.per_scan)
    print(run_table(result["runs"][0]) if len(drives) == 1 else runs_table(result["runs"]))
    for sentence in result["smoothing"]["words"]:
        print(f"  {sentence}")
    print(f"  wrote {out / 'compare.json'} and {out / 'compare.html'}")


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parsed = _parse(sys.argv[1:] if arguments is None else arguments)
    return run_command(lambda: _compare(parsed))


if __name__ == "__main__":
    sys.exit(main())
