# SPDX-License-Identifier: Apache-2.0
"""From our axes (X right, Y up, Z back) to those of ROS (X forward, Y left, Z up): of bodies and worlds alike."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis.mounts import R_OURS_FROM_FLU
from ignis.poses import Poses, Trajectory, quaternion_conjugate, quaternion_from_matrix, quaternion_product

_Q_ROS_FROM_OURS = quaternion_from_matrix(R_OURS_FROM_FLU.T)


def vectors_to_ros(vectors: NDArray[Any]) -> NDArray[Any]:
    """(..., 3) coordinates; an exchange of axes, so no digit is lost."""
    return np.stack([-vectors[..., 2], -vectors[..., 0], vectors[..., 1]], axis=-1)


def poses_to_ros(poses: Poses) -> Poses:
    """Body to world with both in ROS axes."""
    quaternion = quaternion_product(
        quaternion_product(_Q_ROS_FROM_OURS, poses.quaternion), quaternion_conjugate(_Q_ROS_FROM_OURS)
    )
    return Poses(vectors_to_ros(poses.position), quaternion)


def trajectory_to_ros(trajectory: Trajectory) -> Trajectory:
    """The same for stamped poses."""
    return Trajectory(trajectory.utime, poses_to_ros(trajectory.poses))
