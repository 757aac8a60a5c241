r"""ESKF-only beside smoothed: a horizontal slice of the map, the trajectory, and the loops that were closed.

    ./ignis replay LOG --no-loops --config CFG --out A && ./ignis replay LOG --config CFG --out B
    ./ignis shell env PYTHONPATH=python python3 bench/loop_pictures.py A B --truth TRUTH.tum \\
        -o docs/images/NAME.png [--title TEXT]
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from scipy.spatial import KDTree

from ignis import trajectory_error
from ignis.clouds import read_ply
from ignis.poses import Trajectory, read_tum

SLICE_M = (-0.2, 1.0)  # of heights over the sensor's path: walls, racks and pillars, no floor and no ceiling


def keyframes(results: Path) -> tuple[dict[int, np.ndarray], list[tuple[int, int]]]:
    """Positions by id, and the pairs that loops join."""
    positions, loops, loop_follows = {}, [], False
    for line in (results / "keyframes.g2o").read_text().splitlines():
        word = line.split()
        if word[0] == "VERTEX_SE3:QUAT":
            positions[int(word[1])] = np.array([float(v) for v in word[2:5]])
        elif word[0] == "EDGE_SE3:QUAT" and loop_follows:
            loops.append((int(word[1]), int(word[2])))
        loop_follows = line.startswith("# loop")
    return positions, loops


def slice_of_map(results: Path, path: np.ndarray) -> np.ndarray:
    points, _ = read_ply(results / "map.ply")
    _, nearest = KDTree(path[:, [0, 2]]).query(points[:, [0, 2]], workers=1)
    height = points[:, 1] - path[nearest, 1]
    return points[(height > SLICE_M[0]) & (height < SLICE_M[1])]


def draw(axes: Axes, map_of: Path, trajectory: Trajectory, truth: Trajectory, name: str) -> None:
    path = trajectory.poses.position
    points = slice_of_map(map_of, path)
    pair = trajectory_error.paired(trajectory, truth)
    rmse = trajectory_error.errors_of(pair, False)["ate_rmse_m"]
    axes.scatter(points[:, 0], points[:, 2], s=0.15, c="0.45", linewidths=0, rasterized=True)
    axes.plot(path[:, 0], path[:, 2], c="tab:blue", linewidth=0.7)
    axes.set_title(f"{name}: ATE {rmse:.3f} m", fontsize=10)
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.set_xlabel("x [m]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("without", type=Path, help="results of a replay with --no-loops: gives the map on the left")
    parser.add_argument("closed", type=Path, help="results of the replay with loops")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--title", default="")
    arguments = parser.parse_args()
    truth = read_tum(arguments.truth)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 6.5), sharex=True, sharey=True, layout="constrained")
    draw(left, arguments.without, read_tum(arguments.closed / "eskf.tum"), truth, "ESKF only")
    draw(right, arguments.closed, read_tum(arguments.closed / "smoothed.tum"), truth, "smoothed")
    positions, loops = keyframes(arguments.closed)
    lines = [(positions[a][[0, 2]], positions[b][[0, 2]]) for a, b in loops]
    right.add_collection(LineCollection(lines, colors="tab:red", linewidths=1.2))
    left.set_ylabel("z [m]")
    figure.suptitle(f"{arguments.title} ({len(loops)} loops in red)" if arguments.title else "")
    figure.savefig(arguments.output, dpi=90)


if __name__ == "__main__":
    main()
