# SPDX-License-Identifier: Apache-2.0
"""Shared fixtures. The generated message types come from the build when it is on the path, else they are made here."""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from checkout import ROOT


def pytest_configure() -> None:
    if importlib.util.find_spec("ignis_lcm") is None:
        folder = Path(tempfile.mkdtemp(prefix="ignis-types-"))
        generator = Path(sys.executable).parent / "lcm-gen"
        types = sorted(str(path) for path in (ROOT / "lcmtypes").glob("*.lcm"))
        subprocess.run([str(generator), "--python", "--ppath", str(folder / "ignis_lcm"), *types], check=True)
        sys.path.insert(0, str(folder))


@pytest.fixture(autouse=True)
def _without_build(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Configurations are parsed here, not by whatever front end happens to be built."""
    monkeypatch.setenv("IGNIS_BUILD", str(tmp_path / "no-build"))


@pytest.fixture
def level_config(tmp_path: Path) -> Path:
    """A configuration whose sensors sit level, in ROS axes, at the body origin."""
    path = tmp_path / "level.json"
    path.write_text(json.dumps({"extrinsics": {"lidar": {"axes": "forward_left_up"}, "imu": {}}}))
    return path


@pytest.fixture(scope="session")
def kitti() -> Path:
    """The real KITTI recording, where it lies."""
    folder = Path(os.environ.get("IGNIS_DATA", ROOT.parent / "shared" / "data")) / "kitti_raw_0013"
    if not folder.is_dir():
        pytest.skip("not run, data absent: kitti_raw_0013")
    return folder
