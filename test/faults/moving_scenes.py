# SPDX-License-Identifier: Apache-2.0
"""Scenes in which most of what faces along the way moves: lanes of trucks on both sides, and people in a hall."""

import json
import random
from pathlib import Path
from typing import Any

_FLOOR = {"normal": [0, 1, 0], "offset_m": 0.0, "reflectivity": 0.3}
_DRIVE_SECONDS = 70.0
_TRUCK_LENGTH_M, _TRUCK_SPACING_M = 10.0, 13.0


def _box(center: list[float], size: list[float], reflectivity: float = 0.5) -> dict[str, Any]:
    return {"center_m": center, "size_m": size, "reflectivity": reflectivity}


def _straight(length_m: float, speed_m_s: float) -> dict[str, Any]:
    """Rest of 3 s, straight ahead, and at rest again."""
    return {
        "speed_m_s": speed_m_s,
        "acceleration_m_s2": 0.6,
        "waypoints": [
            {"position_m": [0, 0.6, 0], "rest_s": 3},
            {"position_m": [0, 0.6, -length_m], "rest_s": 2},
        ],
    }


def _lane(x: float, speed_m_s: float, ahead: bool, trucks: int) -> list[dict[str, Any]]:
    """Trucks one behind the other that come from in front or from behind."""
    boxes = [
        _box([0, 2.0, 0], [2.4, 2.9, _TRUCK_LENGTH_M]),
        _box([0, 0.4, -3.5], [2.2, 0.8, 1.0], 0.2),
        _box([0, 0.4, 3.5], [2.2, 0.8, 1.0], 0.2),
    ]
    way = speed_m_s * _DRIVE_SECONDS
    lane = []
    for i in range(trucks):
        begin = -45.0 - i * _TRUCK_SPACING_M if ahead else 25.0 + i * _TRUCK_SPACING_M
        waypoints = [{"position_m": [x, 0, begin]}, {"position_m": [x, 0, begin + (way if ahead else -way)]}]
        lane.append({"name": f"truck {x} {i}", "speed_m_s": speed_m_s, "waypoints": waypoints, "boxes": boxes})
    return lane


def trucks_on_both_sides() -> dict[str, Any]:
    """A street of 18 m that lanes of trucks fill: those on the left overtake, those on the right come the other way."""
    chance = random.Random(5)
    facades = [_box([-9.5, 5, -40], [1, 10, 160]), _box([9.5, 5, -40], [1, 10, 160])]
    for z in range(40, -120, -6):
        facades += [_box([side * 8.8, 2.0, z + chance.uniform(-1, 1)], [0.8, 4.0, 0.6]) for side in (-1, 1)]
    return {
        "description": "Street with lanes of trucks on both sides",
        "planes": [_FLOOR],
        "boxes": facades,
        "movers": _lane(-3.0, 3.0, ahead=False, trucks=12) + _lane(3.0, 2.0, ahead=True, trucks=15),
        "trajectory": _straight(60, 1.2),
    }


def _person(chance: random.Random, number: int) -> dict[str, Any]:
    """Walks to and fro beside the way."""
    side = chance.choice((-1, 1))
    x, begin = side * chance.uniform(1.2, 4.5), chance.uniform(-50, 10)
    end = begin - chance.choice((-1, 1)) * chance.uniform(8, 20)
    speed = chance.uniform(0.6, 1.6)
    return {
        "name": f"person {number}",
        "speed_m_s": speed,
        "loop": True,
        "waypoints": [{"position_m": [x, 0, begin]}, {"position_m": [x + side * chance.uniform(0, 1), 0, end]}],
        "cylinders": [{"center_m": [0, 0.75, 0], "axis": "y", "radius_m": 0.25, "length_m": 1.5, "reflectivity": 0.5}],
        "spheres": [{"center_m": [0, 1.62, 0], "radius_m": 0.13, "reflectivity": 0.5}],
    }


def people_in_a_hall(people: int) -> dict[str, Any]:
    """A hall of 40 m x 80 m, pillars 8 m to the left and right, and people on both sides of the way."""
    boxes = [
        _box([0, 4, 20.5], [41, 8, 1]),
        _box([0, 4, -60.5], [41, 8, 1]),
        _box([-20.5, 4, -20], [1, 8, 81]),
        _box([20.5, 4, -20], [1, 8, 81]),
    ]
    boxes += [_box([x, 4, z], [0.6, 8, 0.6]) for z in range(15, -60, -10) for x in (-8, 8)]
    chance = random.Random(3)
    return {
        "description": "Hall with a crowd",
        "planes": [_FLOOR, {"normal": [0, -1, 0], "offset_m": -8.0, "reflectivity": 0.4}],
        "boxes": boxes,
        "movers": [_person(chance, i) for i in range(people)],
        "trajectory": _straight(40, 1.0),
    }


def write_scene(folder: Path, name: str, scene: dict[str, Any]) -> None:
    """For `--scene-folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(scene, indent=1))
