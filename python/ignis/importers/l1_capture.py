# SPDX-License-Identifier: Apache-2.0
"""Raw L1 captures: the driver decodes them; here only the log's stamps are put in order."""

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

from ignis.errors import EXIT_DAMAGED, InputError
from ignis.logs import LogDamage, LogWriter, read_log
from ignis.mounts import set_options

# Frames of the sensor: magic 0xFD, payload length, message id in bytes 7..9, 12 bytes around the payload.
_MAGIC, _HEADER_BYTES, _FRAME_OVERHEAD = 0xFD, 10, 12
_SENSOR_MESSAGES = (13, 16, 17, 18, 19)
_PROBE_BYTES = 1 << 16


def is_capture(head: bytes) -> bool:
    """True when the bytes hold three sensor frames one behind the other."""
    return any(byte == _MAGIC and _chain_length(head, at) >= 3 for at, byte in enumerate(head[:_PROBE_BYTES]))


def _chain_length(head: bytes, at: int) -> int:
    frames = 0
    while at + _HEADER_BYTES <= len(head) and head[at] == _MAGIC and frames < 3:
        if int.from_bytes(head[at + 7 : at + 10], "little") not in _SENSOR_MESSAGES:
            break
        frames, at = frames + 1, at + _FRAME_OVERHEAD + head[at + 1]
    return frames


def import_capture(path: Path, config: Path, output: Path, changes: Sequence[str] = ()) -> list[str]:
    """Runs the driver over the capture and writes the log with records in order of their content."""
    driver = Path(os.environ.get("IGNIS_BUILD", ".")) / "bin" / "l1_driver"
    if not driver.is_file():
        raise InputError(f"{driver} does not exist; run ./ignis build first")
    decoded = output.with_name(output.name + ".decoded")
    environment = {**os.environ, "LCM_DEFAULT_URL": f"file://{decoded.resolve()}?mode=w"}
    command = [str(driver), "--capture", str(path), "--config", str(config), *set_options(changes)]
    try:
        run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if run.returncode not in (0, EXIT_DAMAGED) or not decoded.is_file() or decoded.stat().st_size == 0:
            reason = run.stderr.strip().removeprefix("l1_driver: ") or "the driver found nothing in it"
            raise InputError(f"cannot import {path}: {reason}")
        remarks = _write_in_order(decoded, output, path)
        if run.returncode == EXIT_DAMAGED:
            remarks.append(run.stderr.strip().removeprefix("l1_driver: "))
        return remarks
    finally:
        decoded.unlink(missing_ok=True)


def _write_in_order(decoded: Path, output: Path, source: Path) -> list[str]:
    damage = LogDamage()
    records: list[tuple[int, int, str, bytes]] = []
    for event in read_log(decoded, damage=damage):
        complete = event.message.utime + getattr(event.message, "duration_us", 0)
        records.append((complete, len(records), event.channel, event.message.encode()))
    counts = {name: sum(record[2] == name for record in records) for name in ("L1_SCAN", "L1_IMU")}
    if 0 in counts.values():
        raise InputError(f"{source} holds {counts['L1_SCAN']} scans and {counts['L1_IMU']} inertial samples; need both")
    with LogWriter(output) as writer:
        for utime, _, channel, data in sorted(records):
            writer.write(utime, channel, data)
    return [f"{counts['L1_SCAN']} scan messages and {counts['L1_IMU']} inertial samples from the driver"]
