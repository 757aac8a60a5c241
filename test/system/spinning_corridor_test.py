# SPDX-License-Identifier: Apache-2.0
"""A spinning LiDAR where nothing tells how far along: rings that cross an edge must not pass for walls ahead."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

CONFIG = Path(os.environ["IGNIS_CHECKOUT"]) / "config" / "spinning.json"
LIDAR = 'lidar={"model": "spinning", "spinning": {"beams": 64}}'


def test_a_bare_corridor_is_named_and_the_covariance_bears_the_drift(tmp_path: Path) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "ignis.evaluate", "--scenes", "corridor_bare", "--seeds", "2"),
            *("--config", CONFIG, "--scene-set", LIDAR, "--out", tmp_path),
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    shutil.rmtree(tmp_path / "inputs", ignore_errors=True)  # 400 MB
    assert done.returncode == 0, done.stdout + done.stderr
    (drive,) = json.loads((tmp_path / "evaluation.json").read_text())
    # With planes of four points as thin as a ring, 0 % were named, the vehicle stood still and the NEES was 720,000.
    assert drive["named_percent"] > 90 and drive["nees_position"] < 4
