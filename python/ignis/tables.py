# SPDX-License-Identifier: Apache-2.0
"""Comma-separated tables to columns."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis.errors import InputError

Columns = dict[str, NDArray[Any]]


def read_table(path: Path) -> Columns:
    """Columns by name: int64 where all values are whole numbers, float64 where all are numbers, else text."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the table {path}: {error}") from None
    if not rows:
        raise InputError(f"the table {path} is empty")
    names, body = rows[0], rows[1:]
    if any(len(row) != len(names) for row in body):
        raise InputError(f"{path} has rows with another number of columns than its first line")
    return {name: _column([row[index] for row in body]) for index, name in enumerate(names)}


def _column(words: list[str]) -> NDArray[Any]:
    for kind in (np.int64, np.float64):
        try:
            return np.array([kind(word) for word in words], dtype=kind)
        except ValueError:
            continue
    return np.array(words, dtype=np.str_)
