# SPDX-License-Identifier: Apache-2.0
"""Simulated drives, made once per scene, seed and change of the scene."""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path

from ignis.errors import InputError, run_quietly
from ignis.files import write_text


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


def simulate(l1_sim: Path, scene: Path, seed: int, config: Path, changes: list[str], folder: Path) -> Simulation:
    """Simulates the drive unless an earlier run left it there complete."""
    variant = _changed_scene(scene, changes, folder)
    out = folder / f"{variant.stem}_{seed}"
    simulation = Simulation(scene.stem, seed, out / "drive.lcm", out / "ground_truth.tum")
    if simulation.truth.exists():
        return simulation
    out.mkdir(parents=True, exist_ok=True)
    partial = simulation.truth.with_suffix(".partial")
    command = [l1_sim, "--scene", variant, "--seed", seed, "--config", config]
    run_quietly([*command, "--log", simulation.log, "--ground-truth", partial])
    partial.rename(simulation.truth)
    return simulation


def _changed_scene(scene: Path, changes: list[str], folder: Path) -> Path:
    if not changes:
        return scene
    content = json.loads(scene.read_text())
    if content.get("geometry"):
        content["geometry"] = os.path.relpath(scene.parent / content["geometry"], folder)
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
