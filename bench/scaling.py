# SPDX-License-Identifier: Apache-2.0
"""How cost grows: runs the benchmarks that have a size, fits exponents, draws them.

ninja -C build/release benchmarks
./ignis shell env PYTHONPATH=python python3 bench/scaling.py build/release/bin -o docs/images/scaling.png
"""

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


@dataclass(frozen=True)
class Curve:
    """One figure of one benchmark over its size."""

    title: str
    program: str
    benchmark: str  # name before the slash
    figure: str  # "cpu_time" or a counter
    unit: str
    over: str = ""  # the counter that is the size; empty: the argument
    size: str = ""  # what the size is, for the axis


CURVES = (
    Curve("scan match", "frontend_benchmark", "match_points", "cpu_time", "us", size="points that go in"),
    Curve(
        "neighbourhood search", "frontend_benchmark", "gather_in_floor", "cpu_time", "ns", "voxels", "voxels in the map"
    ),
    Curve("smoother update, p50", "smoother_benchmark", "drive", "p50_ms", "ms", size="keyframes"),
    Curve("smoother update, p99", "smoother_benchmark", "drive", "p99_ms", "ms", size="keyframes"),
    Curve("map rebuild", "map_benchmark", "rebuild_all", "cpu_time", "ms", size="keyframes"),
    Curve("snapshot of the map", "map_benchmark", "encode_a_snapshot", "bytes", "bytes", size="view radius, m"),
)


def run(program: Path, names: list[str]) -> list[dict]:
    """The benchmarks of these names."""
    pattern = "^(" + "|".join(names) + ")/"
    command = [program, f"--benchmark_filter={pattern}", "--benchmark_format=json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True)
    return json.loads(done.stdout)["benchmarks"]


def points_of(curve: Curve, results: list[dict]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes and figures, ascending."""
    rows = []
    for result in results:
        name, size, *_ = result["name"].split("/")
        if name == curve.benchmark:
            rows.append((float(result[curve.over] if curve.over else size), float(result[curve.figure])))
    if len(rows) < 2:
        sys.exit(f"{curve.benchmark} of {curve.program} gave {len(rows)} points: nothing to fit")
    sizes, figures = np.array(sorted(rows)).T
    return sizes, figures


def draw(curves: list[tuple[Curve, np.ndarray, np.ndarray, float]], path: Path) -> None:
    """Log-log, one panel each, with the fitted line."""
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.5), layout="constrained")
    for axis, (curve, sizes, values, exponent) in zip(axes.flat, curves, strict=True):
        axis.loglog(sizes, values, "o", color="#2a78d6")
        scale = np.exp(np.mean(np.log(values) - exponent * np.log(sizes)))
        axis.loglog(sizes, scale * sizes**exponent, "-", color="#9aa7b5", linewidth=1)
        axis.set_title(f"{curve.title}: exponent {exponent:.2f}")
        axis.set_xlabel(curve.size)
        axis.set_ylabel(curve.unit)
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.grid(visible=True, which="both", alpha=0.25)
    figure.savefig(path, dpi=90)


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path, help="folder of the benchmarks")
    parser.add_argument("-o", "--out", type=Path, required=True, help="picture")
    arguments = parser.parse_args()
    results = {}
    for program in dict.fromkeys(curve.program for curve in CURVES):
        print(f"scaling: {program}", file=sys.stderr, flush=True)
        names = list(dict.fromkeys(curve.benchmark for curve in CURVES if curve.program == program))
        results[program] = run(arguments.programs / program, names)
    drawn = []
    print("| what | over | from | to | exponent |\n|---|---|---|---|---|")
    for curve in CURVES:
        sizes, values = points_of(curve, results[curve.program])
        exponent = float(np.polyfit(np.log(sizes), np.log(values), 1)[0])
        drawn.append((curve, sizes, values, exponent))
        ends = [f"{value:,.4g} {curve.unit} at {size:,.0f}" for size, value in zip(sizes, values, strict=True)]
        print(f"| {curve.title} | {curve.size} | {ends[0]} | {ends[-1]} | {exponent:.2f} |")
    draw(drawn, arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
