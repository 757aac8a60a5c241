# SPDX-License-Identifier: Apache-2.0
"""Charts as inline SVG. World axes: X right, Y up, Z back; views from above show -Z upwards."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ignis.poses import Trajectory

ESKF, SMOOTHED, TRUTH = "ESKF only", "smoothed", "ground truth"
_COLOURS = {ESKF: "#d95f02", SMOOTHED: "#1f6fb4", TRUTH: "#333333"}
_OTHERS = ("#7b3fa0", "#2a8f5b", "#b5417b", "#8a6d1a", "#3a7d8c", "#c23b3b")
_MOST_POINTS = 2000
_AXES = ("x", "y", "z")
_AXIS_COLOURS = ("#c23b3b", "#2a8f5b", "#1f6fb4")


def colour_of(label: str, labels: Sequence[str]) -> str:
    """The same label has the same colour on every chart of a page."""
    others = [name for name in labels if name not in _COLOURS]
    return _COLOURS.get(label) or _OTHERS[others.index(label) % len(_OTHERS)]


def svg(figure: Figure) -> str:
    """The figure as an SVG element; closes the figure."""
    stream = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": str(figure.get_suptitle())}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    pyplot.close(figure)
    text = stream.getvalue()
    return text[text.index("<svg") :]


def _thinned(count: int) -> slice:
    return slice(None, None, max(1, -(-count // _MOST_POINTS)))


def _prepared(axes: Axes, x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _line(label: str) -> dict[str, Any]:
    """The wider one lies below: where two estimates agree, both are seen."""
    if label == TRUTH:
        return {"lw": 5.0, "alpha": 0.3}
    return {"lw": 2.2} if label == ESKF else {"lw": 1.0}


def from_above(
    trajectories: Mapping[str, Trajectory], loops: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]] = ()
) -> str:
    """Ways from above, and loops as lines between their keyframes."""
    figure, axes = pyplot.subplots(figsize=(6.4, 6.0), layout="constrained")
    for start, end in loops:
        axes.plot([start[0], end[0]], [-start[2], -end[2]], color="#2a8f5b", lw=1.6, zorder=3)
    if loops:
        axes.plot([], [], color="#2a8f5b", lw=1.6, label="loop")
    for label, trajectory in trajectories.items():
        p = trajectory.poses.position[_thinned(len(trajectory))]
        axes.plot(p[:, 0], -p[:, 2], color=colour_of(label, list(trajectories)), label=label, **_line(label))
    first = next(iter(trajectories.values())).poses.position[0]
    axes.plot(first[0], -first[2], "D", color="#222222", ms=5, label="start")
    _prepared(axes, "X, right [m]", "-Z, forward [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=9)
    return svg(figure)


def from_the_side(trajectories: Mapping[str, Trajectory]) -> str:
    """Height over the way driven."""
    figure, axes = pyplot.subplots(figsize=(6.4, 6.0), layout="constrained")
    for label, trajectory in trajectories.items():
        p = trajectory.poses.position
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
        chosen = _thinned(len(p))
        axes.plot(way[chosen], p[chosen, 1], color=colour_of(label, list(trajectories)), label=label, **_line(label))
    _prepared(axes, "way driven [m]", "Y, up [m]")
    axes.legend(fontsize=9)
    return svg(figure)


def over_time(series: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]], title: str, y: str) -> str:
    """Lines over seconds."""
    figure, axes = pyplot.subplots(figsize=(12.4, 3.2), layout="constrained")
    figure.suptitle(title, fontsize=11)
    for label, (seconds, values) in series.items():
        chosen = _thinned(len(values))
        axes.plot(seconds[chosen], values[chosen], color=colour_of(label, list(series)), label=label, **_line(label))
    _prepared(axes, "time [s]", y)
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=9)
    return svg(figure)


def reasons(seconds: NDArray[np.float64], reason: NDArray[np.str_], applied: NDArray[np.bool_]) -> str:
    """Each scan that did not correct the state, on the line of its reason; below, the share applied per second."""
    names = [str(name) for name in dict.fromkeys(reason[~applied].tolist())]
    height = 1.6 + 0.32 * max(len(names), 1)
    figure, (top, bottom) = pyplot.subplots(
        2, 1, figsize=(12.4, height + 1.0), layout="constrained", sharex=True, height_ratios=[max(len(names), 1), 2]
    )
    for row, name in enumerate(names):
        at = seconds[~applied & (reason == name)]
        top.plot(at[_thinned(len(at))], np.full(len(at), row)[_thinned(len(at))], "|", ms=9, color="#c2410c")
    top.set_yticks(range(len(names)), names)
    top.set_ylim(len(names) - 0.5, -0.5)
    top.spines[["top", "right"]].set_visible(False)
    if not names:
        top.text(0.5, 0.5, "every scan was applied", transform=top.transAxes, ha="center", va="center")
        top.set_yticks([])
    if len(seconds):
        edges = np.arange(np.floor(seconds[0]), seconds[-1] + 1.0)
        total, _ = np.histogram(seconds, [*edges, edges[-1] + 1.0])
        good, _ = np.histogram(seconds[applied], [*edges, edges[-1] + 1.0])
        share = 100.0 * good / np.maximum(total, 1)
        chosen = _thinned(len(edges))
        bottom.fill_between(edges[chosen], share[chosen], step="post", color="#1f6fb4", alpha=0.45)
    _prepared(bottom, "time [s]", "applied [%]")
    bottom.set_ylim(0.0, 105.0)
    return svg(figure)


def milliseconds(seconds: NDArray[np.float64], values: NDArray[np.float64]) -> str:
    """Time per scan, with median and 99 %."""
    figure, axes = pyplot.subplots(figsize=(12.4, 3.0), layout="constrained")
    chosen = _thinned(len(values))
    axes.plot(seconds[chosen], values[chosen], ".", ms=2.5, color="#1f6fb4", alpha=0.6)
    for ratio, name, side in ((50, "median", "top"), (99, "99 %", "bottom")):
        level = float(np.percentile(values, ratio))
        axes.axhline(level, color="#c2410c", lw=0.9)
        axes.annotate(f"{name} {level:.2f} ms", (seconds[-1], level), ha="right", va=side, fontsize=9)
    _prepared(axes, "time [s]", "front end [ms]")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.01)
    return svg(figure)


def biases(seconds: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]]) -> str:
    """Both biases with three standard deviations to either side."""
    figure, rows = pyplot.subplots(2, 3, figsize=(12.4, 5.0), layout="constrained", sharex=True)
    for row, (name, unit) in zip(
        rows, (("gyro_bias", "gyro bias [rad/s]"), ("accel_bias", "accel bias [m/s²]")), strict=True
    ):
        for axes, axis, colour in zip(row, _AXES, _AXIS_COLOURS, strict=True):
            chosen = _thinned(len(seconds))
            value = columns[f"{name}_{axis}"][chosen]
            spread = 3.0 * columns[f"sigma_{name}_{axis}"][chosen]
            axes.fill_between(seconds[chosen], value - spread, value + spread, color=colour, alpha=0.18, lw=0)
            axes.plot(seconds[chosen], value, color=colour, lw=1.1)
            _prepared(axes, "", "")
            axes.set_title(f"{unit}, {axis}", fontsize=10)
    for axes in rows[1]:
        axes.set_xlabel("time [s]")
    return svg(figure)


def bars(groups: Mapping[str, Mapping[str, float]], title: str, unit: str) -> str:
    """One group of bars a key, one bar an estimate."""
    labels = list(dict.fromkeys(label for group in groups.values() for label in group))
    figure, axes = pyplot.subplots(figsize=(max(5.6, 1.2 + 0.5 * len(groups) * len(labels)), 3.6), layout="constrained")
    figure.suptitle(title, fontsize=11)
    width = 0.8 / max(len(labels), 1)
    for index, label in enumerate(labels):
        places = [
            at + (index - (len(labels) - 1) / 2) * width for at, group in enumerate(groups.values()) if label in group
        ]
        values = [group[label] for group in groups.values() if label in group]
        drawn = axes.bar(places, values, width=width * 0.92, color=colour_of(label, labels), label=label)
        if len(groups) * len(labels) <= 12:
            axes.bar_label(drawn, fmt="{:.3f}", fontsize=8)
    axes.set_xticks(range(len(groups)), list(groups), rotation=0 if len(groups) < 4 else 30, fontsize=9)
    _prepared(axes, "", unit)
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=len(labels), fontsize=9, frameon=False)
    return svg(figure)


def heat(
    cells: Sequence[Sequence[float]], rows: Sequence[str], columns: Sequence[str], names: tuple[str, str], title: str
) -> str:
    """A table in colours; NaN where there is nothing."""
    figure, axes = pyplot.subplots(figsize=(2.2 + 0.9 * len(columns), 1.8 + 0.6 * len(rows)), layout="constrained")
    figure.suptitle(title, fontsize=11)
    values = np.array(cells, dtype=float)
    axes.imshow(values, cmap="viridis_r", aspect="auto")
    middle = (np.nanmin(values) + np.nanmax(values)) / 2.0
    for (row, column), value in np.ndenumerate(values):
        colour = "white" if value > middle else "black"
        axes.text(column, row, "-" if np.isnan(value) else f"{value:.4f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(columns)), list(columns))
    axes.set_yticks(range(len(rows)), list(rows))
    axes.set(xlabel=names[1], ylabel=names[0])
    return svg(figure)
