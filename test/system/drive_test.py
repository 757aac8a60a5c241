# SPDX-License-Identifier: Apache-2.0
"""A simulated drive through the real executables, over real LCM: bytes on a pty in, corrected map and pose out."""

import json
import os
import signal
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from live_agreement import require_equal_up_to_the_first_drop

from ignis import results
from ignis.compare import comparison
from ignis.errors import EXIT_DAMAGED
from ignis.log_config import recorded_config
from ignis.pipeline import Pipeline, effective_config
from ignis.run_folder import losses_in

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
PORT = 18080
# The back end starts this long after the others, so it must ask for the keyframes that it missed.
LATE_SECONDS = 12.0


class Drive:
    """A finished drive and what it left behind."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log = folder / "run.lcmlog"
        self.words = ""
        self.page = b""
        self.status: dict[str, Any] = {}
        self.summary: dict[str, Any] = {}


@pytest.fixture(scope="module")
def drive(private_network, tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """Drives the quick scene once; the tests below look at different sides of it."""
    result = Drive(tmp_path_factory.mktemp("drive"))
    config = ("--config", CONFIG)
    tty = result.folder / "l1.pty"
    with Pipeline(result.folder, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        pipeline.start("lcm-logger", "--quiet", result.log)
        pipeline.start("map_builder", *config, "--port", PORT)
        pipeline.start("lio_frontend", *config)
        simulator = pipeline.start("l1_sim", "--scene", SCENE, *config, "--pty", tty, "--wait", 20)
        pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        pipeline.start("l1_driver", *config, "--port", tty)
        time.sleep(LATE_SECONDS)
        pipeline.start("graph_backend", *config)
        assert simulator.wait(180) == 0, pipeline.last_words("l1_sim")
        time.sleep(3.0)
        result.words = pipeline.last_words("l1_sim")
        pipeline.check("l1_sim", "l1_driver")
        result.page = _get("/")
        result.status = json.loads(_get("/api/status"))
        pipeline.stop("l1_driver", "lio_frontend", "graph_backend", "map_builder", "lcm-logger")
    result.summary = results.write_results(result.log, result.folder)
    return result


def _get(path: str) -> bytes:
    with urllib.request.urlopen(f"http://127.0.0.1:{PORT}{path}", timeout=5) as answer:
        return answer.read()


def test_no_receiver_loses_a_message(drive: Drive) -> None:
    # The back end joins late, so its first message of a channel is not the sender's; that counts as no loss.
    missed = {
        (process, channel): counts
        for process, channels in drive.summary["receivers"].items()
        for channel, counts in channels.items()
        if counts["lost"] + counts["rejected"] + counts["queue_drops"] > 0
    }
    assert not missed, f"{missed}; {drive.words}"


def test_scans_correct_the_state(drive: Drive) -> None:
    assert drive.summary["scans"] > 1000
    assert drive.summary["applied"] > 0.9 * drive.summary["scans"], drive.summary["rejected"]


def test_pose_stays_near_the_truth(drive: Drive) -> None:
    figures = comparison(drive.folder)["trajectories"]
    assert figures["eskf"]["ate_rmse_m"] < 0.15, drive.words
    assert figures["smoothed"]["ate_rmse_m"] < 0.15


def test_late_back_end_gets_every_keyframe_and_closes_a_loop(drive: Drive) -> None:
    assert drive.summary["keyframes"] > 10
    assert drive.summary["keyframes_in_graph"] == drive.summary["keyframes"]
    assert drive.summary["loops"]["accepted"] >= 1


def test_view_serves_the_page_and_the_map(drive: Drive) -> None:
    assert b"<html" in drive.page.lower()
    # The quick drive stays within the mid level's window, so nothing has reached the coarse level yet.
    assert drive.summary["voxels"]["local"] > 1000 and drive.summary["voxels"]["mid"] > 1000
    assert drive.status


def test_replay_of_the_recording_equals_the_live_run(drive: Drive, run_binary, tmp_path: Path) -> None:
    reports = []
    for name in ("first", "second"):
        done = run_binary("lio_replay", drive.log, "--config", CONFIG, "--out", tmp_path / name, seconds=120)
        reports.append(json.loads((tmp_path / name / "report.json").read_text()))
        # A busy machine loses datagrams, in the recorder as well.
        assert done.returncode == (EXIT_DAMAGED if losses_in(reports[-1]) else 0), done.stdout
    assert reports[0]["trajectory_hash"] == reports[1]["trajectory_hash"]
    assert reports[0]["map_hash"] == reports[1]["map_hash"]
    for file in ("eskf.tum", "smoothed.tum", "keyframes.g2o", "map.pcd", "map.ply", "scan_stats.csv", "loops.csv"):
        assert (tmp_path / "first" / file).read_bytes() == (tmp_path / "second" / file).read_bytes(), file
    assert reports[0]["live"]["recorded_scans"] > 500 and reports[0]["live"]["graph"]["loop_results"]["recorded"] > 10
    require_equal_up_to_the_first_drop(reports[0])


def test_interrupted_demo_ends_every_process_and_keeps_what_it_computed(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    demo = subprocess.Popen(
        [CHECKOUT / "ignis", "demo", "--quick", "--no-serve", "--out", folder],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not (folder / "logs" / "l1_driver.log").exists():
        assert demo.poll() is None and time.monotonic() < deadline
        time.sleep(0.2)
    time.sleep(15.0)
    os.killpg(demo.pid, signal.SIGINT)
    time.sleep(0.3)
    os.killpg(demo.pid, signal.SIGINT)  # people press Ctrl-C twice
    output, _ = demo.communicate(timeout=60)
    assert "Interrupted" in output
    assert (folder / "run.lcmlog").stat().st_size > 100_000
    assert recorded_config(folder / "run.lcmlog") == json.loads((folder / "config.json").read_text())
    assert (folder / "eskf.tum").exists()
    assert not _running(folder)


def _running(folder: Path) -> set[str]:
    """Process ids of everything that a demo into this folder starts; others may have theirs on this computer."""
    names = f"{os.environ['IGNIS_BUILD']}/bin/(l1_sim|l1_driver|lio_frontend|graph_backend|map_builder) "
    found = subprocess.run(["pgrep", "-f", f"{names}|lcm-logger .*{folder}"], capture_output=True, text=True)
    return set(found.stdout.split())
