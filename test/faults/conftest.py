# SPDX-License-Identifier: Apache-2.0
"""The drive that the fault tests share."""

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
