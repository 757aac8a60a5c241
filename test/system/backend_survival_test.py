# SPDX-License-Identifier: Apache-2.0
"""The real back end over real LCM: killed in the middle of a drive, and with datagrams lost."""

import json
import os
import random
import threading
from pathlib import Path

import pytest

from keyframe_source import BackendRun, Outcome, record_keyframes

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
DRIVE_SECONDS = 60.0
INTERVAL = 0.25  # [s] between keyframes; on the vehicle some seconds
SAME_TRAJECTORY = 1e-3  # [m]


@pytest.fixture(scope="module")
def keyframes(private_network, tmp_path_factory: pytest.TempPathFactory) -> list[list[bytes]]:
    """A recorded drive."""
    recorded = record_keyframes(tmp_path_factory.mktemp("recording"), SCENE, CONFIG, DRIVE_SECONDS)
    assert len(recorded) > 10
    return recorded


@pytest.fixture(scope="module")
def undisturbed(keyframes: list[list[bytes]], tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """What the back end makes of it when nothing goes wrong."""
    outcome = BackendRun(tmp_path_factory.mktemp("undisturbed"), CONFIG, keyframes, 0.0, 1).drive(INTERVAL)
    assert len(outcome.poses) == len(keyframes)
    return outcome


def test_killed_back_end_ends_with_the_same_graph(
    keyframes: list[list[bytes]], undisturbed: Outcome, tmp_path: Path
) -> None:
    rng = random.Random(7)
    length = len(keyframes) * INTERVAL
    kills = [rng.uniform(1.0, length + 1.0) for _ in range(5)]
    outcome = BackendRun(tmp_path, CONFIG, keyframes, 0.0, 1).drive(INTERVAL, kills)
    assert outcome.kills == 5
    assert outcome.resumes, "no process said that it resumed"
    assert outcome.distance(undisturbed) < SAME_TRAJECTORY
    assert outcome.revision == undisturbed.revision
    print("kills at", kills, "keyframes sent again", outcome.asked_again)
    assert max(map(len, outcome.asked_again)) <= 1, "whatever was in the graph is in the journal"
    assert any(outcome.asked_again), "no kill cost a keyframe, so nothing was seen of how one comes again"


@pytest.fixture
def few_clouds(tmp_path: Path) -> Path:
    """A configuration by which memory holds one or two clouds."""
    config = json.loads(CONFIG.read_text())
    config.pop("$schema", None)
    config["backend"]["cloud_memory_mb"] = 0.1
    path = tmp_path / "few_clouds.json"
    path.write_text(json.dumps(config))
    return path


def test_back_end_with_few_clouds_in_memory_ends_with_the_same_graph_though_it_is_killed(
    keyframes: list[list[bytes]], undisturbed: Outcome, few_clouds: Path, tmp_path: Path
) -> None:
    outcome = BackendRun(tmp_path, few_clouds, keyframes, 0.0, 1).drive(INTERVAL, [3.0])
    assert outcome.loops == undisturbed.loops and outcome.loops
    assert outcome.distance(undisturbed) < SAME_TRAJECTORY
    assert outcome.revision == undisturbed.revision


def test_journal_that_gives_no_cloud_back_costs_loops_and_is_told(
    keyframes: list[list[bytes]], few_clouds: Path, tmp_path: Path
) -> None:
    journal = tmp_path / "journal" / "graph_backend.journal"

    def damage() -> None:
        with journal.open("r+b") as file:
            file.write(bytes(journal.stat().st_size))

    threading.Timer(0.5 * len(keyframes) * INTERVAL, damage).start()
    outcome = BackendRun(tmp_path, few_clouds, keyframes, 0.0, 1).drive(INTERVAL)
    assert len(outcome.poses) == len(keyframes)
    assert any("the journal did not give a cloud back" in text for text in outcome.health)


@pytest.mark.parametrize("loss", [0.1])
def test_lost_datagrams_do_not_change_the_graph(
    loss: float, keyframes: list[list[bytes]], undisturbed: Outcome, tmp_path: Path
) -> None:
    outcome = BackendRun(tmp_path, CONFIG, keyframes, loss, 3).drive(INTERVAL)
    assert outcome.dropped > 0
    assert outcome.distance(undisturbed) < SAME_TRAJECTORY
    assert outcome.revision == undisturbed.revision
