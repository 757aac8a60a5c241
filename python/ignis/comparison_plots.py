# SPDX-License-Identifier: Apache-2.0
"""Plots of trajectories and their errors. World axes: X right, Y up, Z back; pictures show -Z upwards."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.figure import Figure

from ignis.files import replacing
from ignis.poses import Trajectory
from ignis.trajectory_error import paired, position_errors

_COLOURS = {"ESKF only": "#d95f02", "smoothed": "#1f6fb4"}


def save(figure: Figure, path: Path) -> None:
    """Writes a picture under its final name once it is complete."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    pyplot.close(figure)


def plot_trajectories(path: Path, trajectories: dict[str, Trajectory], truth: Trajectory | None) -> None:
    """Top view, and height over the distance driven."""
    figure, (top, side) = pyplot.subplots(2, 1, figsize=(10, 11), height_ratios=[3, 1], layout="constrained")
    drawn = dict(trajectories)
    if truth is not None:
        span = next(iter(trajectories.values())).utime
        drawn = {"ground truth": truth.at(span), **trajectories}
    for label, trajectory in drawn.items():
        p = trajectory.poses.position
        style = {"color": _COLOURS.get(label, "black"), "lw": 1.2, "label": label}
        if label == "ground truth":
            style |= {"lw": 2.5, "alpha": 0.4}
        top.plot(p[:, 0], -p[:, 2], **style)
        distance = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
        side.plot(distance, p[:, 1], **style)
    top.set(xlabel="X, right [m]", ylabel="-Z, forward [m]", title="top view")
    top.axis("equal")
    side.set(xlabel="distance driven [m]", ylabel="Y, up [m]", title="height")
    for axes in (top, side):
        axes.grid(alpha=0.3)
        axes.legend()
    save(figure, path)


def plot_errors(path: Path, aligned: dict[str, Trajectory], truth: Trajectory) -> None:
    """Distance from the ground truth over time, after alignment."""
    figure, axes = pyplot.subplots(figsize=(10, 4), layout="constrained")
    for label, trajectory in aligned.items():
        pair = paired(trajectory, truth)
        seconds = (pair.truth.utime - pair.truth.utime[0]) * 1e-6
        axes.plot(seconds, position_errors(pair.estimate, pair.truth), color=_COLOURS.get(label), label=label)
    axes.set(xlabel="time [s]", ylabel="position error [m]", title="distance from the ground truth after alignment")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    axes.legend()
    save(figure, path)
