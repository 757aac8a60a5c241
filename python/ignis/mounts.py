# SPDX-License-Identifier: Apache-2.0
"""Mounts of the sensors, with the same meaning as src/common/extrinsics.h, and the configuration that holds them.

Body and world axes: +X right, +Y up, -Z forward.
"""

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from ignis.errors import InputError

# Takes ROS axes (X forward, Y left, Z up) to ours: (x, y, z)_ours = (-y, z, -x)_ros.
R_OURS_FROM_FLU = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
# Takes east-north-up to X east, Y up, Z south.
R_OURS_FROM_ENU = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
AXES = ("forward_left_up", "right_up_back")


def rotation_from_yaw_pitch_roll(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """R = Ry(yaw) Rx(pitch) Rz(-roll) [rad]: yaw to the left, pitch nose up, roll right side down."""
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(-roll), np.sin(-roll)
    about_up = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    about_right = np.array([[1.0, 0.0, 0.0], [0.0, cp, -sp], [0.0, sp, cp]])
    about_back = np.array([[cr, -sr, 0.0], [sr, cr, 0.0], [0.0, 0.0, 1.0]])
    return about_up @ about_right @ about_back


def yaw_pitch_roll_from_rotation(rotation: np.ndarray) -> tuple[float, float, float]:
    """Inverse of rotation_from_yaw_pitch_roll [rad]."""
    pitch = float(np.arcsin(np.clip(-rotation[1, 2], -1.0, 1.0)))
    yaw = float(np.arctan2(rotation[0, 2], rotation[2, 2]))
    roll = float(-np.arctan2(rotation[1, 0], rotation[1, 1]))
    return yaw, pitch, roll


@dataclass(frozen=True)
class Mount:
    """How one sensor sits on the vehicle."""

    axes: str = "forward_left_up"
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    translation_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def from_json(cls, values: dict[str, Any], path: str) -> Self:
        """Builds a mount from its section of the configuration; `path` names the section in messages."""
        unknown = set(values) - set(cls.__dataclass_fields__)
        if unknown:
            raise InputError(f"{path}: unknown key {', '.join(sorted(unknown))}")
        try:
            mount = cls(**{**values, "translation_m": tuple(float(v) for v in values.get("translation_m", (0, 0, 0)))})
            numbers = [float(n) for n in (mount.yaw_deg, mount.pitch_deg, mount.roll_deg, *mount.translation_m)]
        except (TypeError, ValueError):
            raise InputError(f"{path}: angles and translation must be numbers") from None
        if mount.axes not in AXES or len(mount.translation_m) != 3 or not np.all(np.isfinite(numbers)):
            raise InputError(f"{path}: axes must be one of {', '.join(AXES)}, translation_m three numbers")
        return mount

    def rotation(self) -> np.ndarray:
        """R_body_sensor."""
        level = R_OURS_FROM_FLU if self.axes == "forward_left_up" else np.eye(3)
        angles = np.radians([self.yaw_deg, self.pitch_deg, self.roll_deg])
        return rotation_from_yaw_pitch_roll(*angles) @ level

    def translation(self) -> np.ndarray:
        """[m] sensor origin in the body frame."""
        return np.array(self.translation_m, dtype=float)


@dataclass(frozen=True)
class Extrinsics:
    """Mounts of both sensors."""

    lidar: Mount = field(default_factory=Mount)
    imu: Mount = field(default_factory=Mount)


def effective_config(path: Path, changes: Sequence[str] = ()) -> dict[str, Any]:
    """The configuration with all defaults and `changes` (section.key=value), validated by the front end itself.

    Where the front end has not been built, the file is taken as it is; changes then raise InputError.
    """
    if not path.is_file():
        raise InputError(f"cannot read the configuration {path}: no such file")
    front_end = Path(os.environ.get("IGNIS_BUILD", ".")) / "bin" / "lio_frontend"
    text = path.read_text(encoding="utf-8", errors="replace")
    if front_end.is_file():
        printed = subprocess.run(
            [str(front_end), "--config", str(path), *set_options(changes), "--print-config"],
            capture_output=True,
            text=True,
            check=False,
        )
        if printed.returncode != 0:
            raise InputError(
                printed.stderr.strip().removeprefix("lio_frontend: ") or f"{path} was refused by {front_end}"
            )
        text = printed.stdout
    elif changes:
        raise InputError(f"{front_end} does not exist, and --set needs it; run ./ignis build first")
    try:
        config = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"{path} is not JSON: {error}") from None
    if not isinstance(config, dict):
        raise InputError(f"{path} must hold one JSON object")
    return config


def set_options(changes: Sequence[str]) -> list[str]:
    """Changes as options for the executables."""
    return [word for change in changes for word in ("--set", change)]


def mounts_among(changes: Sequence[str]) -> list[str]:
    """The changes that move a sensor: they count when a recording is imported, never for a log in the body frame."""
    return [change for change in changes if change.partition("=")[0].strip().startswith("extrinsics.")]


def refuse_mounts(changes: Sequence[str]) -> None:
    """Raises InputError when logs that are in the body frame already should be computed with other mounts."""
    if moved := mounts_among(changes):
        raise InputError(f"{', '.join(moved)}: logs are in the body frame already; mounts count at import alone")


def read_extrinsics(path: Path, changes: Sequence[str] = ()) -> Extrinsics:
    """The mounts that a configuration file with changes (section.key=value) describes."""
    section = effective_config(path, changes).get("extrinsics", {})
    if not isinstance(section, dict) or not all(isinstance(section.get(name, {}), dict) for name in ("lidar", "imu")):
        raise InputError(f"{path}: extrinsics must be an object with the objects lidar and imu")
    return Extrinsics(
        Mount.from_json(section.get("lidar", {}), f"{path}: extrinsics.lidar"),
        Mount.from_json(section.get("imu", {}), f"{path}: extrinsics.imu"),
    )
