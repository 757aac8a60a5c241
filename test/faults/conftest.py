# SPDX-License-Identifier: Apache-2.0
"""The drive and the libraries that the fault tests share."""

import subprocess
from pathlib import Path

import pytest

from fault_drive import FaultRun, Seen, record_drive


@pytest.fixture(scope="session")
def drive_log(private_network, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sensor's side of a short drive."""
    return record_drive(tmp_path_factory.mktemp("fault_drive"))


@pytest.fixture(scope="session")
def undisturbed(drive_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Seen:
    """What the processes make of it when nothing goes wrong."""
    with FaultRun(tmp_path_factory.mktemp("undisturbed")) as run:
        run.play(drive_log)
        run.seen.status = run.view_status()
        run.seen.frontend_work = run.work("lio_frontend")
    assert len(run.seen.keyframes) >= 3 and set(run.seen.poses) == set(run.seen.keyframes)
    return run.seen


def preloadable(name: str, folder: Path) -> Path:
    """A library made of a C source that lies here."""
    library = folder / f"{name}.so"
    source = Path(__file__).resolve().parent / f"{name}.c"
    subprocess.run(["cc", "-Wall", "-Werror", "-shared", "-fPIC", "-O1", source, "-o", library], check=True)
    return library


@pytest.fixture(scope="session")
def stepped_clock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library that moves the wall clock of whoever loads it."""
    return preloadable("stepped_clock", tmp_path_factory.mktemp("clock"))


@pytest.fixture
def failing_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """A folder, and the file that makes each write into it fail while it exists, to what is started from now on."""
    folder, switch = tmp_path / "card", tmp_path / "broken"
    folder.mkdir()
    monkeypatch.setenv("LD_PRELOAD", str(preloadable("failing_disk", tmp_path)))
    monkeypatch.setenv("FAILING_DISK", str(folder))
    monkeypatch.setenv("FAILING_DISK_SWITCH", str(switch))
    return folder, switch
