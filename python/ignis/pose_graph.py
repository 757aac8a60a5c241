# SPDX-License-Identifier: Apache-2.0
"""Pose graphs in g2o text, as the replay writes them: where the keyframes are and what connects them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ignis.errors import InputError
from ignis.poses import Poses


@dataclass(frozen=True)
class PoseGraph:
    """Vertices by id, and edges as pairs of ids."""

    ids: NDArray[np.int64]
    poses: Poses
    odometry: list[tuple[int, int]]
    loops: list[tuple[int, int]]

    def position_of(self, vertex: int) -> NDArray[np.float64]:
        """[m] of one keyframe."""
        return self.poses.position[int(np.searchsorted(self.ids, vertex))]


def read_pose_graph(path: Path) -> PoseGraph:
    """Reads VERTEX_SE3:QUAT and EDGE_SE3:QUAT; a comment `# loop` marks the edge behind it."""
    vertices: dict[int, list[float]] = {}
    edges: tuple[list[tuple[int, int]], list[tuple[int, int]]] = ([], [])
    loop_follows = False
    try:
        for words in (line.split() for line in path.read_text(encoding="utf-8").splitlines()):
            if words[:1] == ["VERTEX_SE3:QUAT"]:
                vertices[int(words[1])] = [float(word) for word in words[2:9]]
            elif words[:1] == ["EDGE_SE3:QUAT"]:
                edges[loop_follows].append((int(words[1]), int(words[2])))
            loop_follows = words == ["#", "loop"]
    except (OSError, ValueError, IndexError) as error:
        raise InputError(f"cannot read the pose graph {path}: {error}") from None
    ids = np.array(sorted(vertices), dtype=np.int64)
    rows = np.array([vertices[i] for i in ids.tolist()], dtype=float).reshape(-1, 7)
    return PoseGraph(ids, Poses(rows[:, :3], rows[:, [6, 3, 4, 5]]), *edges)
