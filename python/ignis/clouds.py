# SPDX-License-Identifier: Apache-2.0
"""Clouds for pictures: PLY files, and registered scans out of a log."""

from pathlib import Path
from typing import Any

import numpy as np

from ignis.errors import InputError
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.poses import rotation_matrix

_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) [m] and intensities (zeros where the file has none) of a PLY file."""
    data = path.read_bytes()
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise InputError(f"{path} is not a PLY file")
    body = data.find(b"\n", end) + 1
    form, count, properties = _ply_header(data[:end].decode("ascii", errors="replace"), path)
    if form == "ascii":
        names = [name for name, _ in properties]
        lines = data[body:].decode("ascii").split("\n", count)[:count]
        values = np.array([[float(word) for word in line.split()] for line in lines]).reshape(count, -1)
        rows: Any = {name: values[:, index] for index, name in enumerate(names)}
        fields = set(names)
    else:
        order = "<" if form == "binary_little_endian" else ">"
        record = np.dtype([(name, order + kind) for name, kind in properties])
        if len(data) - body < count * record.itemsize:
            raise InputError(f"{path} ends before its {count} points")
        rows = np.frombuffer(data, dtype=record, count=count, offset=body)
        fields = set(record.names or ())
    points = np.stack([np.asarray(rows[name], dtype=float) for name in "xyz"], axis=1)
    intensity = np.asarray(rows["intensity"], dtype=float) if "intensity" in fields else np.zeros(count)
    return points, intensity


def _ply_header(header: str, path: Path) -> tuple[str, int, list[tuple[str, str]]]:
    form, count, properties, element = "", 0, [], ""
    for words in (line.split() for line in header.splitlines()):
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            element = words[1]
            count = int(words[2]) if element == "vertex" else count
        elif words[:1] == ["property"] and element == "vertex":
            if words[1] not in _PLY_TYPES:
                raise InputError(f"{path} has a vertex property of type {words[1]}, which no map has")
            properties.append((words[2], _PLY_TYPES[words[1]]))
    return form, count, properties


def registered_scans(log: Path) -> tuple[np.ndarray, np.ndarray]:
    """All LIO_CLOUD points of a log placed by their own poses, in odom."""
    assembler = PartAssembler()
    points, intensity = [], []
    for _, _, message in read_log(log, ("LIO_CLOUD",)):
        parts = assembler.add(message)
        if parts is None:
            continue
        arrays = joined_arrays(parts)
        body = np.stack([arrays[name] for name in "xyz"], axis=1)
        rotation = rotation_matrix(np.array(message.quaternion))
        points.append(body @ rotation.T + np.array(message.position))
        intensity.append(arrays["intensity"])
    if not points:
        raise InputError(f"{log} holds no registered scan (channel LIO_CLOUD)")
    return np.concatenate(points), np.concatenate(intensity)
