# SPDX-License-Identifier: Apache-2.0
"""Per-point times under every habit that drivers have."""

import numpy as np
import pytest

from ignis.errors import InputError
from ignis.importers.point_times import PointTimes, decide, time_field

HEADERS_NS = [1_700_000_000_000_000_000 + i * 100_000_000 for i in range(5)]
OFFSETS_NS = np.arange(0, 100_000_000, 10_000_000)
SCALE = {"s": 1e-9, "ms": 1e-6, "us": 1e-3, "ns": 1.0}


@pytest.mark.parametrize("unit", SCALE)
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_relative_times_in_any_unit(unit: str, kind: str) -> None:
    values = (OFFSETS_NS * SCALE[unit]).astype(kind)
    times = decide("t", [(header, values) for header in HEADERS_NS], "/points")
    assert times == PointTimes("t", unit, absolute=False)
    np.testing.assert_allclose(times.utime(values, HEADERS_NS[0]), (HEADERS_NS[0] + OFFSETS_NS) // 1000, atol=1)


@pytest.mark.parametrize("unit", ["us", "ns"])
def test_relative_whole_numbers(unit: str) -> None:
    values = (OFFSETS_NS * SCALE[unit]).astype("u4")
    assert decide("t", [(h, values) for h in HEADERS_NS], "/points") == PointTimes("t", unit, absolute=False)


@pytest.mark.parametrize("unit", SCALE)
def test_absolute_times_in_any_unit(unit: str) -> None:
    clouds = [(header, (header + OFFSETS_NS).astype(float) * SCALE[unit]) for header in HEADERS_NS]
    times = decide("timestamp", clouds, "/points")
    assert times == PointTimes("timestamp", unit, absolute=True)
    np.testing.assert_allclose(times.utime(clouds[2][1], 0), (HEADERS_NS[2] + OFFSETS_NS) // 1000, atol=2)


def test_times_counted_backwards_from_the_stamp() -> None:
    values = -(OFFSETS_NS[::-1] * 1e-9).astype("f4")
    times = decide("time", [(h, values) for h in HEADERS_NS], "/points")
    assert times == PointTimes("time", "s", absolute=False)
    assert times.utime(values, HEADERS_NS[0])[0] == pytest.approx(HEADERS_NS[0] // 1000 - 90_000, abs=1)


def test_constant_times_are_no_times() -> None:
    with pytest.raises(InputError, match="no per-point time"):
        decide("t", [(h, np.zeros(9)) for h in HEADERS_NS], "/points")


def test_implausible_spans_are_refused() -> None:
    with pytest.raises(InputError, match="no plausible time"):
        decide("t", [(h, np.linspace(0.0, 1e13, 5)) for h in HEADERS_NS], "/points")


@pytest.mark.parametrize(
    ("names", "found"),
    [(["x", "t"], "t"), (["Timestamp"], "Timestamp"), (["offset_time"], "offset_time"), (["x", "intensity"], None)],
)
def test_the_usual_names_are_known(names: list[str], found: str | None) -> None:
    assert time_field(names) == found
