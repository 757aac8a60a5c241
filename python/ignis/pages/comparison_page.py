# SPDX-License-Identifier: Apache-2.0
"""compare.html: the figures of a comparison with pictures."""

from pathlib import Path
from typing import Any

import numpy as np

from ignis import trajectory_error
from ignis.comparing.estimates import Estimates, label_of
from ignis.comparing.figures import ALIGNMENT, aligned
from ignis.comparing.text_table import rows_of
from ignis.files import write_text
from ignis.pages import charts, html
from ignis.poses import Trajectory

PAGE_NAME = "compare.html"
_MOST_DRAWN = 12


def write_comparison_page(folder: Path, drives: list[Estimates], result: dict[str, Any]) -> Path:
    """Writes the page; `result` is what compare.json holds."""
    page = folder / PAGE_NAME
    words = [html.note(sentence, _kind(sentence)) for sentence in result["smoothing"]["words"]]
    body = [html.section("In words", *words), _bars(drives, result)]
    for drive, figures in zip(drives[:_MOST_DRAWN], result["runs"], strict=False):
        body.append(_drive(drive, figures))
    if len(drives) > _MOST_DRAWN:
        body.append(html.note(f"{len(drives) - _MOST_DRAWN} more drives are in compare.json without a picture."))
    body.append(
        html.section("How each figure is aligned", html.table(("figure", "alignment"), list(ALIGNMENT.items())))
    )
    names = ", ".join(drive.name for drive in drives[:4]) + (" ..." if len(drives) > 4 else "")
    write_text(page, html.document("ESKF only against smoothed", names, body))
    return page


def _kind(sentence: str) -> str:
    if sentence.startswith("Smoothing helped"):
        return "good"
    return "warn" if sentence.startswith("Smoothing did not") else "plain"


def _bars(drives: list[Estimates], result: dict[str, Any]) -> str:
    pieces = []
    for key, title, unit in (
        ("ate_rmse_m", "ATE, SE(3) aligned, rms", "m"),
        ("ate_yaw_rmse_m", "ATE, yaw and position aligned, rms", "m"),
        ("rpe_10m_rmse_m", "RPE per 10 m, rms", "m"),
        ("tilt_rmse_deg", "tilt error, rms", "deg"),
    ):
        groups = {
            drive.name: {
                label_of(name): figures[key]
                for name, figures in run["trajectories"].items()
                if figures.get(key) is not None
            }
            for drive, run in zip(drives, result["runs"], strict=True)
        }
        if any(groups.values()):
            pieces.append(charts.bars(groups, title, unit))
    return html.section("Errors", html.side_by_side(*pieces)) if pieces else ""


def _drive(drive: Estimates, figures: dict[str, Any]) -> str:
    laid = {label_of(name): trajectory for name, trajectory in aligned(drive).items()}
    drawn: dict[str, Trajectory] = {}
    if drive.truth is not None:
        drawn[charts.TRUTH] = drive.truth.at(drive.trajectories["eskf"].utime)
    drawn |= laid
    head = ("", *(label_of(name) for name in figures["trajectories"]))
    return html.section(
        f"{drive.name}: {figures['path_length_m']:.1f} m in {figures['duration_s']:.1f} s",
        *(html.note(note) for note in figures["notes"]),
        html.side_by_side(charts.from_above(drawn), charts.from_the_side(drawn)),
        _errors(drive, laid),
        html.table(head, [(title, *cells) for title, cells in rows_of(figures)]),
    )


def _errors(drive: Estimates, laid: dict[str, Trajectory]) -> str:
    if drive.truth is None:
        return ""
    series = {}
    for label, trajectory in laid.items():
        pair = trajectory_error.paired(trajectory, drive.truth)
        seconds = (pair.truth.utime - pair.truth.utime[0]) * 1e-6
        series[label] = (np.asarray(seconds), trajectory_error.position_errors(pair.estimate, pair.truth))
    return charts.over_time(series, f"distance from the ground truth after alignment, {drive.name}", "error [m]")
