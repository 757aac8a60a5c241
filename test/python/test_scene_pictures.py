# SPDX-License-Identifier: Apache-2.0
"""What the picture of a simulated scene shows."""

import json
from pathlib import Path

from ignis.sim import read_scene


def test_repeated_solids_are_shown_as_often_as_they_stand(tmp_path: Path) -> None:
    box = {"center_m": [1, 2, 3], "size_m": [1, 1, 1], "repeat": {"count": [2, 1, 2], "step_m": [5, 0, -7]}}
    (tmp_path / "hall.json").write_text(json.dumps({"boxes": [box], "cylinders": [{"radius_m": 0.2}]}))
    (tmp_path / "drive.json").write_text(json.dumps({"geometry": "hall.json", "boxes": [{"center_m": [9, 9, 9]}]}))
    scene = read_scene(tmp_path / "drive.json")
    centers = sorted(tuple(solid["center_m"]) for solid in scene["boxes"])
    assert centers == [(1, 2, -4), (1, 2, 3), (6, 2, -4), (6, 2, 3), (9, 9, 9)]
    assert scene["cylinders"] == [{"radius_m": 0.2}]
