# SPDX-License-Identifier: Apache-2.0
"""Comparisons as text for the terminal."""

from typing import Any

from ignis.comparing.estimates import NAMES, label_of

# Key of the figures, title, unit, decimals.
ROWS = (
    ("ate_rmse_m", "ATE, rms", "m", 3),
    ("ate_max_m", "ATE, largest", "m", 3),
    ("ate_yaw_rmse_m", "ATE, yaw and position aligned", "m", 3),
    ("rpe_1m_rmse_m", "RPE per 1 m, rms", "m", 3),
    ("rpe_10m_rmse_m", "RPE per 10 m, rms", "m", 3),
    ("end_error_m", "end-point error", "m", 3),
    ("end_error_percent", "end-point error", "%", 3),
    ("tilt_rmse_deg", "tilt error, rms", "deg", 3),
    ("yaw_rmse_deg", "yaw error, rms", "deg", 3),
    ("nees_position", "NEES, position", "1", 2),
    ("nees_attitude", "NEES, attitude", "1", 2),
    ("end_to_start_m", "end to start", "m", 3),
)
PER_SCAN = (
    ("mean_m", "per scan, mean", "m", 3),
    ("p95_m", "per scan, p95", "m", 3),
    ("max_m", "per scan, max", "m", 3),
    ("mean_deg", "per scan, rotation, mean", "deg", 3),
)
# What stands in the table of several runs.
_SHORT = (
    "ate_rmse_m",
    "ate_yaw_rmse_m",
    "rpe_1m_rmse_m",
    "rpe_10m_rmse_m",
    "end_error_m",
    "tilt_rmse_deg",
    "yaw_rmse_deg",
)
_SHORT_TITLES = ("ATE m", "yaw ATE m", "RPE/1m", "RPE/10m", "end m", "tilt deg", "yaw deg")
_COLUMN = 12


def rows_of(result: dict[str, Any]) -> list[tuple[str, list[str]]]:
    """Title and one cell an estimate; rows without any figure are left out."""
    figures = list(result["trajectories"].values())
    rows = [(f"{title} [{unit}]", [f.get(key) for f in figures], digits) for key, title, unit, digits in ROWS]
    for key, title, unit, digits in PER_SCAN:
        rows.append((f"{title} [{unit}]", [f.get("per_scan", {}).get(key) for f in figures], digits))
    distances = [f.get("distance_from_smoothed", {}).get("rmse_m") for f in figures]
    rows.append(("from smoothed, SE(3), rms [m]", distances, 3))
    return [
        (title, [cell(v, digits) for v in values])
        for title, values, digits in rows
        if any(v is not None for v in values)
    ]


def cell(value: float | None, digits: int) -> str:
    """A figure, or a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def run_table(result: dict[str, Any]) -> str:
    """One run: a row a figure, a column an estimate."""
    lines = [f"{result['folder']}: {result['path_length_m']:.1f} m in {result['duration_s']:.1f} s"]
    lines += [f"  {note}" for note in result["notes"]]
    names = list(result["trajectories"])
    lines.append(f"  {'':34}" + "".join(f"{label_of(name)[: _COLUMN - 1]:>{_COLUMN}}" for name in names))
    for title, cells in rows_of(result):
        lines.append(f"  {title:34}" + "".join(f"{text:>{_COLUMN}}" for text in cells))
    difference = result["smoothed_minus_eskf"]
    lines.append(
        f"  smoothed against ESKF: rms {difference['rmse_m']:.3f} m, largest {difference['max_m']:.3f} m, "
        f"at the end {difference['end_m']:.3f} m"
    )
    return "\n".join(lines)


def runs_table(results: list[dict[str, Any]]) -> str:
    """Several runs: a row an estimate, and the mean over the runs."""
    width = max(4, *(len(_short_name(result)) for result in results)) + 1
    lines = [f"  {'':{width}}{'':12}" + "".join(f"{title:>11}" for title in _SHORT_TITLES) + f"{'loops':>7}"]
    for result in results:
        for name, figures in result["trajectories"].items():
            cells = "".join(f"{cell(figures.get(key), 3):>11}" for key in _SHORT)
            loops = result["loops_kept"] if result["loops_kept"] is not None else "-"
            lines.append(f"  {_short_name(result):{width}}{label_of(name):12}{cells}{loops:>7}")
    for name in NAMES:
        cells = "".join(f"{cell(_mean(results, name, key), 3):>11}" for key in _SHORT)
        lines.append(f"  {'mean':{width}}{label_of(name):12}{cells}")
    return "\n".join(lines)


def _short_name(result: dict[str, Any]) -> str:
    return str(result["folder"]).rstrip("/").rsplit("/", 1)[-1]


def _mean(results: list[dict[str, Any]], name: str, key: str) -> float | None:
    values = [r["trajectories"][name].get(key) for r in results]
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None
