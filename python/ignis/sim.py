# SPDX-License-Identifier: Apache-2.0
"""`./ignis sim`: a simulated drive as the sensor's raw bytes or as a log, with ground truth and a picture."""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from ignis.errors import EXIT_BAD_INPUT, EXIT_FAILURE, EXIT_INTERRUPTED, InputError, run_command
from ignis.files import replacing
from ignis.poses import read_tum

_SOLIDS = ("planes", "boxes", "cylinders", "spheres")
_DEFAULTS: dict[str, Any] = {"center_m": [0.0, 0.0, 0.0], "size_m": [1.0, 1.0, 1.0], "radius_m": 0.5, "length_m": 1.0}
# What hangs higher than this over the floor is drawn as an outline only: beams, ducts, lamps.
_OVERHEAD_M = 2.5
_DOTS_EVERY_S = 20.0


def read_scene(file: Path) -> dict[str, Any]:
    """The scene with the geometry that it takes over. l1_sim has checked the file before."""
    scene = json.loads(file.read_text(encoding="utf-8"))
    if scene.get("geometry"):
        source = json.loads((file.parent / scene["geometry"]).read_text(encoding="utf-8"))
        for kind in _SOLIDS:
            scene[kind] = scene.get(kind, []) + source.get(kind, [])
    for kind in _SOLIDS:
        scene[kind] = [copy for solid in scene.get(kind, []) for copy in _copies(solid)]
    return scene


def _copies(solid: dict[str, Any]) -> list[dict[str, Any]]:
    """The solid itself, or all that its repetition makes of it."""
    if "repeat" not in solid:
        return [solid]
    counts = [int(count) for count in solid["repeat"].get("count", [1, 1, 1])]
    step = np.array(solid["repeat"].get("step_m", [0.0, 0.0, 0.0]))
    first = np.array(solid.get("center_m", _DEFAULTS["center_m"]))
    return [solid | {"center_m": list(first + np.array(index) * step)} for index in np.ndindex(*counts)]


def _box_corners(box: dict[str, Any]) -> np.ndarray:
    """(4, 2) plan view of a box, x and z. A pitched box appears shortened."""
    half = np.array(box["size_m"]) / 2.0
    yaw, pitch = np.radians([box.get("yaw_deg", 0.0), box.get("pitch_deg", 0.0)])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [half[0], half[2] * np.cos(pitch)]
    # Yaw is positive to the left seen from above, with z pointing down on the page.
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    return corners @ turn.T + np.array(box["center_m"])[[0, 2]]


def _cylinder_outline(cylinder: dict[str, Any]) -> Circle | Polygon:
    x, _, z = cylinder["center_m"]
    radius, half = cylinder["radius_m"], cylinder["length_m"] / 2.0
    axis = cylinder.get("axis", "y")
    if axis == "y":
        return Circle((x, z), radius)
    dx, dz = (half, radius) if axis == "x" else (radius, half)
    return Polygon([(x - dx, z - dz), (x + dx, z - dz), (x + dx, z + dz), (x - dx, z + dz)])


def _bottom(solid: dict[str, Any]) -> float:
    """[m] height of the lowest point, roughly: tilted boxes are taken as level."""
    y = solid["center_m"][1]
    if "size_m" in solid:
        return y - solid["size_m"][1] / 2.0
    return y - (solid["length_m"] / 2.0 if solid.get("axis", "y") == "y" and "length_m" in solid else solid["radius_m"])


def _draw_solids(axes: Axes, scene: dict[str, Any]) -> None:
    floor = min((w["position_m"][1] for w in scene["trajectory"]["waypoints"]), default=0.6) - 0.6
    shapes: list[tuple[dict[str, Any], Circle | Polygon]] = [
        (solid, Polygon(_box_corners(solid))) for solid in map(_complete, scene.get("boxes", []))
    ]
    shapes += [(solid, _cylinder_outline(solid)) for solid in map(_complete, scene.get("cylinders", []))]
    shapes += [
        (s, Circle((s["center_m"][0], s["center_m"][2]), s["radius_m"]))
        for s in map(_complete, scene.get("spheres", []))
    ]
    for solid, shape in sorted(shapes, key=lambda pair: _bottom(pair[0])):
        overhead = _bottom(solid) - floor > _OVERHEAD_M
        sphere = "length_m" not in solid and "size_m" not in solid
        shape.set(facecolor="none" if overhead else ("#8fbf7f" if sphere else "#b9c1cb"))
        shape.set(edgecolor="#9aa3ad" if overhead else "#4a525c", linestyle=":" if overhead else "-")
        shape.set(linewidth=0.6, alpha=0.6 if sphere else 1.0)
        axes.add_patch(shape)


def _complete(solid: dict[str, Any]) -> dict[str, Any]:
    keys = ["center_m", "size_m"] if "size_m" in solid else ["center_m", "radius_m"]
    keys += ["length_m"] if "axis" in solid or "length_m" in solid else []
    return {key: _DEFAULTS[key] for key in keys} | solid


def draw_scene(scene: dict[str, Any], ground_truth: Path, picture: Path, title: str) -> None:
    """Plan view: -Z (forward at the start) is up on the page, X to the right, as in the world."""
    truth = read_tum(ground_truth)
    position = truth.poses.position
    seconds = (truth.utime - truth.utime[0]) * 1e-6
    span = np.ptp(position[:, [0, 2]], axis=0) + 12.0
    figure, axes = plt.subplots(figsize=(min(6.0 + span[0] / 5.0, 16.0), min(4.0 + span[1] / 4.0, 16.0)))
    _draw_solids(axes, scene)
    axes.plot(position[:, 0], position[:, 2], color="#c8102e", linewidth=1.6, label="drive")
    marks = np.searchsorted(seconds, np.arange(_DOTS_EVERY_S, seconds[-1], _DOTS_EVERY_S))
    axes.plot(
        position[marks, 0], position[marks, 2], "o", color="#c8102e", markersize=4, label=f"every {_DOTS_EVERY_S:.0f} s"
    )
    axes.plot(*position[0, [0, 2]], "D", color="#0b6623", markersize=8, label="start")
    axes.plot(*position[-1, [0, 2]], "s", color="#1f3a93", markersize=7, label="end")
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.set(xlabel="x, right [m]", ylabel="z, backward [m]", title=title)
    axes.grid(color="#e3e6ea", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    with replacing(picture) as temporary:
        figure.savefig(temporary, format="png", dpi=110, bbox_inches="tight")
    plt.close(figure)


def _build_folder() -> Path:
    folder = os.environ.get("IGNIS_BUILD")
    if not folder:
        raise InputError("IGNIS_BUILD is not set; call this as ./ignis sim")
    return Path(folder)


def _default_config() -> Path | None:
    file = Path(os.environ.get("IGNIS_CHECKOUT", ".")) / "config" / "ignis8.json"
    return file if file.is_file() else None


def simulate(arguments: argparse.Namespace) -> int:
    """Writes the bytes or the log, ground_truth.tum and scene.png into the folder; returns l1_sim's exit code."""
    out: Path = arguments.out
    command = [str(_build_folder() / "bin" / "l1_sim"), "--scene", str(arguments.scene), "--seed", str(arguments.seed)]
    command += ["--config", str(arguments.config)] if arguments.config else []
    command += ["--duration", str(arguments.duration)] if arguments.duration is not None else []
    names = ["drive.lcm" if arguments.log else "capture.bin", "ground_truth.tum"]
    command += ["--log" if arguments.log else "--capture", str(out / names[0]), "--ground-truth", str(out / names[1])]
    if arguments.fault:
        names.append("faults.csv")
        command += ["--fault-list", str(out / names[-1]), "--fault-seed", str(arguments.fault_seed)]
        command += [word for fault in arguments.fault for word in ("--fault", fault)]
    code = subprocess.run(command, check=False).returncode
    if code != 0:
        return code
    draw_scene(read_scene(arguments.scene), out / "ground_truth.tum", out / "scene.png", arguments.scene.stem)
    for name in (*names, "scene.png"):
        print(out / name)
    return 0


def _make_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; give the name of a folder with --out")
    out.mkdir(parents=True, exist_ok=True)


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis sim", description=__doc__)
    parser.add_argument("--scene", type=Path, required=True, help="scene file, such as config/scenes/battery_hall.json")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for capture.bin, ground_truth.tum and scene.png"
    )
    parser.add_argument("--log", action="store_true", help="write drive.lcm for ./ignis replay instead of capture.bin")
    parser.add_argument(
        "--fault",
        action="append",
        metavar="FAULT=RATE",
        help="damage per frame, repeatable: drop, flip, cut, duplicate, stall, reorder, junk; listed in faults.csv",
    )
    parser.add_argument("--fault-seed", type=int, default=1, help="seed of the faults (default 1)")
    parser.add_argument("--seed", type=int, default=1, help="seed of all noise (default 1)")
    parser.add_argument("--duration", type=float, help="end after this many seconds of sensor time")
    parser.add_argument("--config", type=Path, default=_default_config(), help="configuration with the sensor's mount")
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)

    def body() -> int:
        if not parsed.scene.is_file():
            raise InputError(f"there is no scene file {parsed.scene}; the shipped ones are in config/scenes")
        _make_folder(parsed.out)
        code = simulate(parsed)
        # A process ended by a signal has a negative code; those of l1_sim have our meaning already.
        return EXIT_INTERRUPTED if code < 0 else (code if code in (0, EXIT_FAILURE, EXIT_BAD_INPUT) else EXIT_FAILURE)

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
