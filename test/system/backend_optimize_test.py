# SPDX-License-Identifier: Apache-2.0
"""The command that solves a pose graph from a file."""

import math
import random
from pathlib import Path

import pytest


def circle(poses: int, laps: int) -> str:
    """A planar drive round a circle with noisy odometry and an exact edge to the place one lap before."""
    rng = random.Random(1)
    turn, lap = 2.0 * math.pi * laps / poses, poses // laps
    lines = [f"VERTEX_SE2 {i} 0 0 0" for i in range(poses)]
    for i in range(1, poses):
        x, y, heading = 1.0 + rng.gauss(0, 0.01), rng.gauss(0, 0.01), turn + rng.gauss(0, 0.001)
        lines.append(f"EDGE_SE2 {i - 1} {i} {x} {y} {heading} 10000 0 0 10000 0 1000000")
        if i >= lap and i % 5 == 0:
            lines.append(f"EDGE_SE2 {i - lap} {i} 0 0 0 10000 0 0 10000 0 1000000")
    return "\n".join(lines) + "\n"


def cost(output: str, name: str) -> float:
    """Half chi-square in the row of this name."""
    return float(next(row.removeprefix(name).split()[0] for row in output.splitlines() if row.startswith(name)))


def test_both_solutions_are_printed_and_the_graph_is_written(run_binary, tmp_path: Path) -> None:
    (tmp_path / "in.g2o").write_text(circle(200, 4))
    done = run_binary("graph_optimiser", tmp_path / "in.g2o", "-o", tmp_path / "out.g2o")
    assert done.returncode == 0, done.stderr
    assert "200 poses" in done.stdout and "planar" in done.stdout
    again = run_binary("graph_optimiser", tmp_path / "out.g2o")
    incremental, batch = cost(done.stdout, "incremental"), cost(again.stdout, "batch LM")
    assert incremental == pytest.approx(batch, rel=1e-3)
    assert "p50" in done.stdout and "p99" in done.stdout
    assert "lowest from pose by pose" in done.stdout


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (None, "cannot be opened"),
        ("", "no vertex"),
        ("VERTEX_SE2 0 0 0 zero\n", "in.g2o:1: a finite number is missing"),
        ("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 5 0 0 0\n", "no chain of edges joins vertex 0 to 1 of 2 vertices: 5"),
    ],
)
def test_bad_graphs_are_named(text: str | None, expected: str, run_binary, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "in.g2o").write_text(text)
    done = run_binary("graph_optimiser", tmp_path / "in.g2o", "-o", tmp_path / "out.g2o")
    assert done.returncode == 2
    assert expected in done.stderr
    assert not (tmp_path / "out.g2o").exists()


def test_settings_out_of_range_are_named_together(run_binary, tmp_path: Path) -> None:
    (tmp_path / "in.g2o").write_text(circle(20, 1))
    done = run_binary("graph_optimiser", tmp_path / "in.g2o", "--relinearize-skip", 0, "--relinearize-rotation", -1)
    assert done.returncode == 2
    assert "relinearize_skip = 0" in done.stderr and "relinearize_rotation_rad = -1" in done.stderr
