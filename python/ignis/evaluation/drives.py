# SPDX-License-Identifier: Apache-2.0
"""Simulated drives, made once per scene, seed and change of the scene."""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path

from ignis.errors import InputError, run_quietly
from ignis.files import put_in_place, write_text


@dataclass(frozen=True)
class Simulation:
    """A drive on disk."""

    scene: str
    seed: int
    log: Path
    truth: Path

    @property
    def name(self) -> str:
        return f"{self.scene}_{self.seed}"


def simulate(l1_sim: Path, scene: Path, seed: int, config: Path, log: Path, truth: Path) -> None:
    """Drives a scene into an LCM log with ground truth beside it; the truth appears once both are complete."""
    log.parent.mkdir(parents=True, exist_ok=True)
    partial = truth.with_suffix(".partial")
    command = [l1_sim, "--scene", scene, "--seed", seed, "--config", config]
    run_quietly([*command, "--log", log, "--ground-truth", partial])
    put_in_place(partial, truth)


def simulated(l1_sim: Path, scene: Path, seed: int, config: Path, changes: list[str], folder: Path) -> Simulation:
    """The drive of a scene with changes, made unless an earlier run left it there complete."""
    variant = changed_scene(scene, changes, folder)
    out = folder / f"{variant.stem}_{seed}"
    simulation = Simulation(scene.stem, seed, out / "drive.lcm", out / "ground_truth.tum")
    if not simulation.truth.exists():
        simulate(l1_sim, variant, seed, config, simulation.log, simulation.truth)
    return simulation


def changed_scene(scene: Path, changes: list[str], folder: Path) -> Path:
    """A scene file with "section.key=value" set; the scene itself when there is nothing to change."""
    if not changes:
        return scene
    content = json.loads(scene.read_text())
    if content.get("geometry"):
        content["geometry"] = os.path.relpath(scene.parent / content["geometry"], folder)
    for mesh in content.get("meshes", []):
        mesh["file"] = os.path.relpath(scene.parent / mesh["file"], folder)
    for change in changes:
        path, equals, value = change.partition("=")
        *sections, key = path.split(".")
        if not equals or not key:
            raise InputError(f"--scene-set {change}: write section.key=value")
        place = content
        for section in sections:
            place = place.setdefault(section, {})
        place[key] = json.loads(value)
    digest = hashlib.sha256(" ".join(changes).encode()).hexdigest()[:6]
    variant = folder / f"{scene.stem}_{digest}.json"
    folder.mkdir(parents=True, exist_ok=True)
    write_text(variant, json.dumps(content))
    return variant
