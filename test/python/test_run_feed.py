# SPDX-License-Identifier: Apache-2.0
"""The graph of a replay's folder as it leaves in MCAP, also where keyframes that others stand for are missing."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader

from ignis.export import main

_SECONDS = range(6)  # a scan and a keyframe each, one metre apart


def _run_folder(folder: Path, keyframes: list[int]) -> Path:
    """A replay straight on, in the graph of which only these keyframes are left."""
    folder.mkdir()
    (folder / "report.json").write_text(json.dumps({"log": "drive.lcm"}))
    (folder / "config.json").write_text("{}")
    for name, beside in (("eskf", 0.0), ("smoothed", 0.5)):
        rows = [f"{second}.0 {beside} 0 {-second} 0 0 0 1" for second in _SECONDS]
        (folder / f"{name}.tum").write_text("\n".join(rows) + "\n")
    scans = [f"{second * 1_000_000},1,applied" for second in _SECONDS]
    (folder / "scan_stats.csv").write_text("\n".join(["utime,applied,reason", *scans]) + "\n")
    (folder / "eskf_states.csv").write_text("utime,trust\n0,0\n")
    (folder / "loops.csv").write_text("utime,from_id,to_id,reason\n5000000,5,0,accepted\n")
    lines = [f"VERTEX_SE3:QUAT {i} 0.25 0 {-i} 0 0 0 1" for i in keyframes]
    pairs = list(pairwise(keyframes))
    lines += [f"EDGE_SE3:QUAT {a} {b} 0 0 {a - b} 0 0 0 1" for a, b in pairs]
    lines += ["# loop", "EDGE_SE3:QUAT 0 5 0 0 -5 0 0 0 1"]
    (folder / "keyframes.g2o").write_text("\n".join(lines) + "\n")
    return folder


def _drawn(run: Path) -> dict[str, list[tuple[float, float, float]]]:
    """Lines of the graph in the axes of ROS."""
    assert main([str(run), "--to", "mcap", "-o", str(run / "run.mcap")]) == 0
    with (run / "run.mcap").open("rb") as file:
        [message] = [message for _, _, message in make_reader(file).iter_messages(topics=["/graph"])]
    entities = SceneUpdate.FromString(message.data).entities
    return {each.id: [(p.x, p.y, p.z) for p in each.lines[0].points] for each in entities}


@pytest.mark.parametrize(
    ("keyframes", "beside"),
    [pytest.param([0, 1, 2, 3, 4, 5], 0.25, id="keyframes"), pytest.param([0, 1, 4, 5], 0.5, id="smoothed way")],
)
def test_the_way_is_that_of_the_keyframes_where_none_is_missing(
    tmp_path: Path, keyframes: list[int], beside: float
) -> None:
    drawn = _drawn(_run_folder(tmp_path / "run", keyframes))
    np.testing.assert_allclose(drawn["keyframes"], [(second, -beside, 0.0) for second in _SECONDS], atol=1e-12)
    np.testing.assert_allclose(drawn["loops"], [(0.0, -0.25, 0.0), (5.0, -0.25, 0.0)], atol=1e-12)
