# SPDX-License-Identifier: Apache-2.0
"""The configuration inside a log: records on the channel IGNIS_CONFIG hold the effective configuration as JSON text.

They are no LCM type, so that any version reads them and a person can, too.
"""

import json
import mmap
import struct
from pathlib import Path
from typing import Any

CONFIG_CHANNEL = "IGNIS_CONFIG"

_NAME = CONFIG_CHANNEL.encode("ascii")
_HEAD = struct.Struct(">4sqqii")
_SYNC = b"\xed\xa1\xda\x01"


def encoded(config: dict[str, Any]) -> bytes:
    """The data of a record."""
    return json.dumps(config, indent=1).encode("utf-8")


def recorded_config(log: Path) -> dict[str, Any] | None:
    """The first whole configuration in a log, or None. Searches for the channel's name, not record by record."""
    with log.open("rb") as file:
        if log.stat().st_size == 0:
            return None
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as view:
            at = view.find(_NAME)
            while at >= 0:
                config = _config_at(view, at)
                if config is not None:
                    return config
                at = view.find(_NAME, at + 1)
    return None


def _config_at(view: mmap.mmap, at: int) -> dict[str, Any] | None:
    if at < _HEAD.size:
        return None
    sync, _, _, name_length, data_length = _HEAD.unpack_from(view, at - _HEAD.size)
    begin = at + len(_NAME)
    if sync != _SYNC or name_length != len(_NAME) or data_length < 2:
        return None
    try:
        config = json.loads(view[begin : begin + data_length])
    except ValueError:
        return None
    return config if isinstance(config, dict) else None


def differences(a: Any, b: Any, path: str = "") -> list[str]:
    """Paths of the keys whose values differ."""
    if isinstance(a, dict) and isinstance(b, dict):
        return [
            found
            for key in sorted(a.keys() | b.keys())
            for found in differences(a.get(key), b.get(key), f"{path}.{key}" if path else key)
        ]
    return [] if a == b else [path]
