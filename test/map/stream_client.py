# SPDX-License-Identifier: Apache-2.0
"""A client of docs/wire_format.md, written from that page: it holds the voxels and checks every announcement."""

import struct
from dataclasses import dataclass, field

import numpy as np

PROTOCOL = "ignis.lio_map.v2"
HEADER_BYTES = 76
UNCHANGED = 0xFFFFFFFF
LIVE, GONE = 1, 2
RECORD = np.dtype([("cell", "<i2", 3), ("intensity", "u1"), ("flags", "u1")])
EDGE = np.dtype([("from", "<f4", 3), ("to", "<f4", 3), ("from_id", "<u4"), ("to_id", "<u4")])
POINT = np.dtype(("<f4", 3))
MASK = (1 << 64) - 1


def mix(z):
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def voxel_checksum(level, cell, intensity, live):
    a = (cell[0] & 0xFFFFFFFF) << 32 | (cell[1] & 0xFFFFFFFF)
    b = (cell[2] & 0xFFFFFFFF) << 32 | level << 16 | intensity << 8 | live
    return mix((mix((a + 0x9E3779B97F4A7C15) & MASK) + b) & MASK)


@dataclass
class Frame:
    """One binary map frame, decoded."""

    pose: tuple
    cell_m: list
    heights: list
    records: list  # per level: absolute cells (n, 3), intensity, flags
    odometry: np.ndarray | None
    smoothed: np.ndarray | None
    edges: np.ndarray | None


def decode(data):
    cell_m, heights, records, at = [], [], [], HEADER_BYTES
    for k in range(3):
        cell, count, low, high = struct.unpack_from("<fIff", data, 28 + 16 * k)
        origin = np.array(struct.unpack_from("<3i", data, at))
        rows = np.frombuffer(data, RECORD, count, at + 12)
        cell_m.append(cell)
        heights.append((low, high))
        records.append((rows["cell"] + origin, rows["intensity"], rows["flags"]))
        at += 12 + RECORD.itemsize * count
    rest = []
    for kind in (POINT, POINT, EDGE):
        (count,) = struct.unpack_from("<I", data, at)
        at += 4
        if count == UNCHANGED:
            rest.append(None)
            continue
        rest.append(np.frombuffer(data, kind, count, at))
        at += kind.itemsize * count
    assert at == len(data), "bytes behind the end"
    return Frame(struct.unpack_from("<7f", data), cell_m, heights, records, *rest)


@dataclass
class ViewState:
    """What a client holds, kept by snapshots and deltas."""

    voxels: list = field(default_factory=lambda: [{}, {}, {}])  # per level: cell -> (intensity, live)
    checksum: int = 0
    sequence: int = 0
    revision: int = 0
    pose: tuple = ()
    cell_m: list = field(default_factory=list)
    odometry: np.ndarray | None = None
    smoothed: np.ndarray | None = None
    edges: np.ndarray | None = None
    snapshots: int = 0
    deltas: int = 0

    def apply(self, announced, data):
        """Applies a frame; raises AssertionError when it is not what was announced."""
        frame = decode(data)
        if announced["kind"] == "snapshot":
            self.voxels, self.checksum = [{}, {}, {}], 0
            self.snapshots += 1
        else:
            assert announced["base"] == self.sequence
            self.deltas += 1
        for level in range(3):
            self._apply_level(level, *frame.records[level])
        for name in ("odometry", "smoothed", "edges"):
            if getattr(frame, name) is not None:
                setattr(self, name, getattr(frame, name))
        self.sequence, self.revision = announced["sequence"], announced["revision"]
        self.pose, self.cell_m = frame.pose, frame.cell_m
        assert [len(level) for level in self.voxels] == announced["counts"]
        assert f"{self.checksum:016x}" == announced["checksum"]

    def _apply_level(self, level, cells, intensities, flags):
        held = self.voxels[level]
        for cell, intensity, flag in zip(map(tuple, cells.tolist()), intensities.tolist(), flags.tolist(), strict=True):
            before = held.pop(cell, None)
            if before is not None:
                self.checksum = (self.checksum - voxel_checksum(level, cell, *before)) & MASK
            if flag & GONE:
                assert before is not None, "a voxel that was never there is gone"
                continue
            held[cell] = (intensity, flag & LIVE)
            self.checksum = (self.checksum + voxel_checksum(level, cell, *held[cell])) & MASK

    def centres(self, level):
        """Centres of a level's voxels [m] and their live flags."""
        cells = np.array(list(self.voxels[level]), dtype=float).reshape(-1, 3)
        live = np.array([live for _, live in self.voxels[level].values()])
        return self.cell_m[level] * (cells + 0.5), live
