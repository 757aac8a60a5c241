# SPDX-License-Identifier: Apache-2.0
"""Per-point times of point clouds: which field, which unit, and counted from what.

Drivers disagree on all three and do not say, so the decision comes from the first clouds: absolute when the values,
read in some unit, lie beside the header's stamp; otherwise relative, in the unit that makes a cloud about as long as
the interval between clouds.
"""

from dataclasses import dataclass

import numpy as np

from ignis.errors import InputError

FIELD_NAMES = ("t", "time", "timestamp", "offset_time", "time_stamp", "time_offset", "ts", "stamp", "timeoffset")
SECONDS_PER_UNIT = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# [s] absolute times lie this close to the header's stamp.
_NEAR_S = 10.0
# A cloud may last between 1/50 and 3 times the interval between clouds.
_SHORTEST, _LONGEST = 0.02, 3.0


@dataclass(frozen=True)
class PointTimes:
    """The decision for one topic."""

    field: str  # empty: none, every point has the stamp of its cloud
    unit: str
    absolute: bool

    def describe(self) -> str:
        """The decision in words."""
        if not self.field:
            return "no per-point time: every point has its cloud's stamp (--no-deskew); motion blurs the clouds"
        origin = "absolute" if self.absolute else "relative to the header's stamp"
        return f"per-point time: field {self.field}, {self.unit}, {origin}"

    def utime(self, values: np.ndarray, header_ns: int) -> np.ndarray:
        """Instants [us]."""
        if np.issubdtype(values.dtype, np.integer):
            nanoseconds = values.astype(np.int64) * round(SECONDS_PER_UNIT[self.unit] * 1e9)
        else:
            nanoseconds = np.rint(values.astype(np.float64) * (SECONDS_PER_UNIT[self.unit] * 1e9)).astype(np.int64)
        return (nanoseconds if self.absolute else nanoseconds + header_ns) // 1000


WITHOUT = PointTimes("", "ns", absolute=False)


def time_field(names: list[str]) -> str | None:
    """The field that holds times, by its name."""
    lowered = {name.lower(): name for name in names}
    return next((lowered[name] for name in FIELD_NAMES if name in lowered), None)


def decide(field: str, clouds: list[tuple[int, np.ndarray]], topic: str) -> PointTimes:
    """Decides from the first clouds: (header stamp [ns], values of the field) each."""
    spans = [float(values.max() - values.min()) for _, values in clouds if len(values) > 1]
    span = float(np.median(spans)) if spans else 0.0
    if span <= 0.0:
        raise InputError(
            f"the field {field} of {topic} is the same for all points of a cloud, so there is no per-point time; "
            "record with a driver that fills it"
        )
    headers = np.array([header for header, _ in clouds]) * 1e-9
    first = np.array([float(values.min()) for _, values in clouds])
    for unit, seconds in SECONDS_PER_UNIT.items():
        if np.median(np.abs(first * seconds - headers)) < _NEAR_S and np.median(headers) > 100.0 * _NEAR_S:
            return PointTimes(field, unit, absolute=True)
    interval = float(np.median(np.diff(headers))) if len(headers) > 1 else 0.1
    interval = interval if interval > 0.0 else 0.1
    ratios = {unit: span * seconds / interval for unit, seconds in SECONDS_PER_UNIT.items()}
    unit = min(ratios, key=lambda name: abs(np.log(ratios[name])))
    if not _SHORTEST <= ratios[unit] <= _LONGEST:
        raise InputError(
            f"the field {field} of {topic} spans {span:g} per cloud, which is no plausible time in s, ms, us or ns for "
            f"clouds {interval:g} s apart"
        )
    return PointTimes(field, unit, absolute=False)
