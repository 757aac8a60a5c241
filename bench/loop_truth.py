r"""Are the loops of simulated drives true? One row per seed: loops in the final graph that are wrong, loops in it,
loops that left it, keyframes that came back to a place, and the errors of odometry and smoothed trajectory.

    ./ignis shell env PYTHONPATH=python python3 bench/loop_truth.py \
        --scene config/scenes/identical_rooms.json --seeds 20 --work FOLDER
"""

import argparse
import csv
import json
import subprocess
from pathlib import Path

import numpy as np

from ignis import trajectory_error
from ignis.errors import EXIT_DAMAGED
from ignis.poses import Poses, Trajectory, read_tum

ROOT = Path(__file__).resolve().parent.parent

WRONG_M = 0.5
REVISIT_M = 4.0  # horizontally, to a place that the loop closer may take for a candidate
REVISIT_TURN = np.pi / 4
INDEX_GAP = 10


def simulate_and_replay(arguments: argparse.Namespace, seed: int) -> Path:
    folder = arguments.work / f"{arguments.scene.stem}_{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    config = ["--config", str(arguments.config)]
    log, truth = folder / "drive.lcm", folder / "ground_truth.tum"
    if not truth.exists():
        scene = ["--scene", str(arguments.scene), "--seed", str(seed)]
        output = ["--log", str(log), "--ground-truth", str(truth)]
        subprocess.run([arguments.bin / "l1_sim", *scene, *config, *output], check=True, capture_output=True)
    results = folder / "results"
    replay = [arguments.bin / "lio_replay", str(log), *config, "--out", str(results)]
    run = subprocess.run(replay, capture_output=True)
    if run.returncode not in (0, EXIT_DAMAGED):  # a drive with gaps has loops as well
        raise subprocess.CalledProcessError(run.returncode, replay, run.stdout, run.stderr)
    return folder


def keyframe_stamps(results: Path) -> np.ndarray:
    """The loop table has rows for every keyframe, in their order, and later ones for earlier loops."""
    with (results / "loops.csv").open() as file:
        stamps = [int(row["utime"]) for row in csv.DictReader(file)]
    return np.unique(stamps)


def loop_edges(results: Path) -> list[tuple[int, int, np.ndarray]]:
    """(to, from, position of `from` in `to`) of the loops in the final graph, which a comment marks. Those of absorbed
    keyframes are not among them: a drive that long needs backend.retired_spacing_m 0."""
    edges = []
    is_loop = False
    for line in (results / "keyframes.g2o").read_text().splitlines():
        word = line.split()
        if is_loop and word[:1] == ["EDGE_SE3:QUAT"]:
            edges.append((int(word[1]), int(word[2]), np.array([float(v) for v in word[3:6]])))
        is_loop = word == ["#", "loop"]
    return edges


def wrong_loops(edges: list[tuple[int, int, np.ndarray]], truth: Poses) -> int:
    wrong = 0
    for to, source, position in edges:
        between = truth[np.array([to])].inverse() @ truth[np.array([source])]
        wrong += bool(np.linalg.norm(between.position[0] - position) > WRONG_M)
    return wrong


def revisiting(truth: Poses) -> np.ndarray:
    """Keyframes from which a loop could have been closed."""
    ahead = np.array([truth.matrices()[i][:3, 2] for i in range(len(truth))])
    found = []
    for i in range(INDEX_GAP, len(truth)):
        distance = np.linalg.norm((truth.position[: i - INDEX_GAP + 1] - truth.position[i])[:, [0, 2]], axis=1)
        aligned = ahead[: i - INDEX_GAP + 1] @ ahead[i] > np.cos(REVISIT_TURN)
        if np.any((distance < REVISIT_M) & aligned):
            found.append(i)
    return np.array(found, dtype=int)


def rms(results: Path, name: str, truth: Trajectory) -> float:
    pair = trajectory_error.paired(read_tum(results / f"{name}.tum"), truth)
    return trajectory_error.errors_of(pair, False)["ate_rmse_m"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--config", type=Path, default=ROOT / "config" / "ignis8_tuned.json")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--bin", type=Path, default=ROOT / "build" / "release" / "bin")
    parser.add_argument("--work", type=Path, required=True, help="folder for logs (kept) and results")
    arguments = parser.parse_args()
    print("seed   wrong   in graph   withdrawn   revisits   ATE eskf   ATE smoothed", flush=True)
    wrong_in_all = 0
    for seed in range(1, arguments.seeds + 1):
        folder = simulate_and_replay(arguments, seed)
        results = folder / "results"
        truth = read_tum(folder / "ground_truth.tum")
        at_keyframes = truth.at(keyframe_stamps(results)).poses
        edges = loop_edges(results)
        wrong = wrong_loops(edges, at_keyframes)
        wrong_in_all += wrong
        withdrawn = json.loads((results / "report.json").read_text())["loops_withdrawn"]
        errors = [rms(results, name, truth) for name in ("eskf", "smoothed")]
        counts = f"{wrong:7d} {len(edges):10d} {withdrawn:11d} {len(revisiting(at_keyframes)):10d}"
        print(f"{seed:4d} {counts} {errors[0]:10.4f} {errors[1]:14.4f}", flush=True)
    print(f"wrong loops in all: {wrong_in_all}")


if __name__ == "__main__":
    main()
