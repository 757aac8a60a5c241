# SPDX-License-Identifier: Apache-2.0
"""Whether the configured mounts can be true."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ignis.doctoring.finding import Finding, Severity
from ignis.mounts import Mount

# Both parts of an L1 sit in one housing of 75 x 75 x 65 mm.
_HOUSING_M = 0.1
_VEHICLE_M = 3.0
_SAME_ANGLE_DEG = 2.0


def check_mount(extrinsics: dict[str, Any], *, is_l1: bool = True) -> Iterator[Finding]:
    """Plausibility of both mounts. `is_l1`: scanner and inertial unit share a housing."""
    lidar = Mount.from_json(extrinsics["lidar"], "extrinsics.lidar")
    imu = Mount.from_json(extrinsics["imu"], "extrinsics.imu")
    fix = "./ignis mount-check   # at rest on level ground; then correct the section extrinsics"
    troubles = []
    for name, mount in (("lidar", lidar), ("imu", imu)):
        if (far := float(np.linalg.norm(mount.translation()))) > _VEHICLE_M:
            troubles.append(f"{name} sits {far:.1f} m from the body origin: millimetres instead of metres?")
    angle = _angle_deg(lidar.rotation() @ imu.rotation().T)
    apart = float(np.linalg.norm(lidar.translation() - imu.translation()))
    if is_l1 and angle > _SAME_ANGLE_DEG:
        troubles.append(f"lidar and imu are turned by {angle:.1f} degrees against each other, but share a housing")
    if is_l1 and apart > _HOUSING_M:
        troubles.append(f"lidar and imu are {apart:.2f} m apart, but share a housing of 0.075 m")
    for text in troubles:
        yield Finding("mount", "extrinsics", Severity.ERROR, text, fix)
    if not troubles:
        text = (
            f"lidar pitch {lidar.pitch_deg:.1f}, roll {lidar.roll_deg:.1f} degrees; imu {1000 * apart:.0f} mm beside it"
        )
        yield Finding("mount", "extrinsics", Severity.OK, text)


def _angle_deg(rotation: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0))))
