# SPDX-License-Identifier: Apache-2.0
"""Pictures of a map: from above, from the side and obliquely. `python3 -m ignis.pictures DIR`.

Points are painted one by one, the nearest to the viewer last; colour is height, brightness is reflectivity.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from matplotlib import colormaps, image
from scipy.spatial import KDTree

from ignis.clouds import read_ply, registered_scans
from ignis.errors import InputError, run_command
from ignis.files import replacing
from ignis.poses import read_tum

_WIDTH, _HEIGHT = 1600, 1000
_BACKGROUND = np.array([14, 17, 22], dtype=np.uint8)
_PATH_COLOUR = np.array([255, 255, 255], dtype=np.uint8)
# [m] the view from above leaves out what hangs higher over the path than this: ceilings, tree tops.
_CUT_ABOVE_PATH_M = 2.0
# [m] half the width of what oblique and side views show around the path.
_SURROUNDINGS_M = 30.0
_OBLIQUE_TILT_DEG, _OBLIQUE_TURN_DEG = 32.0, 25.0


def write_pictures(folder: Path) -> list[Path]:
    """Writes map_top.png, map_oblique.png and map_side.png for a results folder; returns their paths."""
    points, intensity = _load(folder)
    path_file = next((folder / n for n in ("smoothed.tum", "eskf.tum") if (folder / n).is_file()), None)
    path = read_tum(path_file).poses.position if path_file else points.mean(axis=0, keepdims=True)
    distance, nearest = KDTree(path).query(points, workers=-1)
    colours = _colours(points[:, 1] - path[nearest, 1], intensity)
    low = points[:, 1] < path[nearest, 1] + _CUT_ABOVE_PATH_M
    near = distance < _SURROUNDINGS_M
    facing = _heading(path)
    views = {
        "map_top.png": (low, _axes_from_above(facing)),
        "map_oblique.png": (near & low, _axes_oblique(facing)),
        "map_side.png": (near, _axes_from_side(facing)),
    }
    written = []
    for name, (chosen, axes) in views.items():
        picture = _paint(points[chosen] @ axes.T, colours[chosen], path @ axes.T)
        with replacing(folder / name) as temporary:
            image.imsave(temporary, picture, format="png")
        written.append(folder / name)
    return written


def _load(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    if (folder / "map.ply").is_file():
        points, intensity = read_ply(folder / "map.ply")
    elif (folder / "run.lcmlog").is_file():
        points, intensity = registered_scans(folder / "run.lcmlog")
    else:
        raise InputError(f"{folder} has neither map.ply nor run.lcmlog; run ./ignis replay with --out {folder} first")
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise InputError(f"the map in {folder} has no points")
    return points[finite], intensity[finite]


def _heading(path: np.ndarray) -> float:
    """[rad] direction about up of the path's longest extent; 0 looks along -Z."""
    flat = path[:, [0, 2]] - path[:, [0, 2]].mean(axis=0)
    if len(path) < 2:
        return 0.0
    direction = np.linalg.svd(flat, full_matrices=False)[2][0]
    direction = direction if direction @ (path[-1] - path[0])[[0, 2]] >= 0 else -direction
    return float(np.arctan2(-direction[0], -direction[1]))


def _basis(heading: float, tilt: float) -> np.ndarray:
    """Rows: right, up and towards the viewer on the picture; the viewer looks down by `tilt` [rad]."""
    right = np.array([np.cos(heading), 0.0, -np.sin(heading)])
    backward = np.array([np.sin(heading), 0.0, np.cos(heading)])
    up = np.array([0.0, 1.0, 0.0])
    towards = np.cos(tilt) * backward + np.sin(tilt) * up
    return np.stack([right, np.cross(towards, right), towards])


def _axes_from_above(facing: float) -> np.ndarray:
    """The path's long extent lies across the picture."""
    return _basis(facing + np.pi / 2, np.pi / 2)


def _axes_oblique(facing: float) -> np.ndarray:
    return _basis(facing + np.pi / 2 + np.radians(_OBLIQUE_TURN_DEG), np.radians(_OBLIQUE_TILT_DEG))


def _axes_from_side(facing: float) -> np.ndarray:
    return _basis(facing + np.pi / 2, 0.0)


def _colours(height: np.ndarray, intensity: np.ndarray) -> np.ndarray:
    """(N, 3) bytes: hue by height above the path, brightness by rank of reflectivity."""
    low, high = np.percentile(height, [2, 98])
    hue = np.clip((height - low) / max(high - low, 0.1), 0.0, 1.0)
    ranks = np.argsort(np.argsort(intensity, kind="stable"), kind="stable") / max(len(intensity) - 1, 1)
    brightness = 0.45 + 0.55 * ranks if np.ptp(intensity) > 0 else np.ones(len(intensity))
    return (colormaps["turbo"](0.08 + 0.84 * hue)[:, :3] * brightness[:, None] * 255.0).astype(np.uint8)


def _paint(view: np.ndarray, colours: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Draws points (right, up, towards the viewer) and the path into a picture that fits them."""
    low, high = np.percentile(view[:, :2], [0.5, 99.5], axis=0)
    low, high = np.minimum(low, path[:, :2].min(axis=0)), np.maximum(high, path[:, :2].max(axis=0))
    scale = 0.96 * min(_WIDTH / max(high[0] - low[0], 1.0), _HEIGHT / max(high[1] - low[1], 1.0))
    height = int(np.clip((high[1] - low[1]) * scale / 0.96, 300, _HEIGHT))
    canvas = np.tile(_BACKGROUND, (height, _WIDTH, 1))
    centre = (low + high) / 2.0
    order = np.argsort(view[:, 2], kind="stable")
    size = 1 if len(view) > 400_000 else 2
    _stamp(canvas, view[order, :2], colours[order], centre, scale, size)
    steps = np.linspace(0, len(path) - 1, 20 * len(path))
    line = np.stack([np.interp(steps, np.arange(len(path)), path[:, axis]) for axis in (0, 1)], axis=1)
    _stamp(canvas, line, np.tile(_PATH_COLOUR, (len(line), 1)), centre, scale, 2)
    return canvas


def _stamp(
    canvas: np.ndarray, at: np.ndarray, colours: np.ndarray, centre: np.ndarray, scale: float, size: int
) -> None:
    height, width = canvas.shape[:2]
    column = np.floor((at[:, 0] - centre[0]) * scale + width / 2).astype(int)
    row = np.floor((centre[1] - at[:, 1]) * scale + height / 2).astype(int)
    for down in range(size):
        for along in range(size):
            r, c = row + down, column + along
            inside = (r >= 0) & (r < height) & (c >= 0) & (c < width)
            canvas[r[inside], c[inside]] = colours[inside]


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis.pictures", description=__doc__)
    parser.add_argument("folder", type=Path, help="results folder with map.ply or run.lcmlog")
    parsed = parser.parse_args(sys.argv[1:] if arguments is None else arguments)

    def body() -> None:
        for path in write_pictures(parsed.folder):
            print(f"wrote {path}")

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
