# SPDX-License-Identifier: Apache-2.0
"""A live simulated run, recorded by `./ignis record` over the real bus, and replayed bit for bit."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import lcm
import pytest
from ignis_lcm.ignis import imu_t
from live_agreement import require_equal_up_to_the_first_drop

from ignis import read_log
from ignis.errors import EXIT_DAMAGED
from ignis.log_config import recorded_config
from ignis.pipeline import Pipeline, effective_config
from ignis.run_folder import losses_in

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
DRIVE_SECONDS = 20.0


class Live:
    """A recorded run and what the recorder said."""

    def __init__(self, log: Path, code: int, said: str) -> None:
        self.log, self.code, self.said = log, code, said


def recorder(pipeline: Pipeline, *arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "ignis.record", *map(str, arguments)]
    return subprocess.Popen(
        command, env=pipeline.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def ended(process: subprocess.Popen[str], by: signal.Signals | None) -> tuple[int, str]:
    if by is not None:
        process.send_signal(by)
    said, _ = process.communicate(timeout=30)
    return process.returncode, said


@pytest.fixture(scope="module")
def live(private_network: None, tmp_path_factory: pytest.TempPathFactory) -> Live:
    """Everything runs; the recorder starts first and is ended by Ctrl-C last."""
    folder = tmp_path_factory.mktemp("live")
    config = ("--config", CONFIG)
    tty, log = folder / "l1.pty", folder / "live.lcmlog"
    with Pipeline(folder, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        process = recorder(pipeline, "-o", log, *config)
        while not log.exists():
            assert process.poll() is None
            time.sleep(0.1)
        pipeline.start("graph_backend", *config)
        pipeline.start("lio_frontend", *config)
        pipeline.start("l1_sim", "--scene", SCENE, *config, "--pty", tty, "--wait", 20)
        pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        pipeline.start("l1_driver", *config, "--port", tty)
        time.sleep(DRIVE_SECONDS)
        pipeline.check()
        pipeline.stop("l1_sim")
        time.sleep(2.0)
        pipeline.stop("l1_driver", "lio_frontend", "graph_backend")
        code, said = ended(process, signal.SIGINT)
    return Live(log, code, said)


def replayed(live: Live, folder: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "ignis.replay", live.log, "--out", folder, "--no-page"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=120, check=False)
    report: dict[str, Any] = json.loads((folder / "report.json").read_text())
    # A busy machine loses datagrams, in the recorder as well.
    assert done.returncode == (EXIT_DAMAGED if losses_in(report) else 0), done.stderr
    return report


def test_the_log_holds_every_channel_and_the_configuration(live: Live) -> None:
    log = read_log(live.log)
    assert {"L1_IMU", "L1_SCAN", "L1_STATUS", "LIO_STATE", "LIO_SCAN_STATS", "LIO_CLOUD", "LIO_KEYFRAME"} <= set(log)
    assert {"SMOOTHED_KEYFRAMES", "SMOOTHED_STATE", "HEALTH", "GROUND_TRUTH"} <= set(log)
    assert log.config is not None and log.config["frontend"] == effective_config(CONFIG)["frontend"]
    assert not log.damage


def test_the_recorder_counts_what_the_log_has_and_misses(live: Live) -> None:
    imu = read_log(live.log, ["L1_IMU"])["L1_IMU"]
    row = next(line.split() for line in live.said.splitlines() if line.strip().startswith("L1_IMU"))
    missing = int(imu["sequence"][-1] - imu["sequence"][0]) + 1 - imu.count
    assert (int(row[1]), int(row[4])) == (imu.count, missing)
    assert live.code in (0, 3) and (live.code == 3) == ("messages are missing" in live.said)


def test_the_replay_equals_the_live_run_bit_for_bit_up_to_the_first_drop(live: Live, tmp_path: Path) -> None:
    report = replayed(live, tmp_path / "run")
    agreement = report["live"]
    assert agreement["recorded_scans"] > 0.9 * DRIVE_SECONDS * 20 and agreement["first_sequence"] == 0
    graph = agreement["graph"]
    assert graph["keyframes"]["recorded"] >= 4 and graph["smoothed_states"]["recorded"] > 100
    assert graph["revisions"]["recorded"] > graph["loop_results"]["recorded"], "full sets come as well"
    require_equal_up_to_the_first_drop(report)


def test_a_gap_on_the_bus_is_warned_of(private_network: None, tmp_path: Path) -> None:
    url = effective_config(CONFIG)["lcm"]["url"]
    with Pipeline(tmp_path, url) as pipeline:
        process = recorder(pipeline, "-o", tmp_path / "a.lcmlog", "--config", CONFIG, "--seconds", "4")
        while not (tmp_path / "a.lcmlog").exists():
            time.sleep(0.1)
        time.sleep(0.5)
        bus = lcm.LCM(url)
        for sequence, pause_s in ((0, 0.0), (1, 0.0), (2, 0.0), (7, 0.0), (8, 0.3), (9, 0.0)):
            message = imu_t()
            message.sequence = sequence
            bus.publish("L1_IMU", message.encode())
            time.sleep(pause_s)  # The logger flushes after a tenth of a second, and only when a message comes.
        code, said = ended(process, None)
    assert code == 3, said
    assert "WARNING: 4 messages missed so far, most on L1_IMU" in said and "GB free" in said
    assert read_log(tmp_path / "a.lcmlog")["L1_IMU"]["sequence"].tolist() == [0, 1, 2, 7, 8, 9]


def test_split_recordings_hold_the_configuration_in_each_file(private_network: None, tmp_path: Path) -> None:
    url = effective_config(CONFIG)["lcm"]["url"]
    with Pipeline(tmp_path, url) as pipeline:
        common = ["--config", CONFIG, "--seconds", "7", "--split-mb", "1"]
        process = recorder(pipeline, "-o", tmp_path / "a.lcmlog", *common)
        while not (tmp_path / "a.lcmlog.00").exists():
            assert process.poll() is None
            time.sleep(0.1)
        time.sleep(0.7)
        bus = lcm.LCM(url)
        for sequence in range(1200):
            message = imu_t()
            message.sequence = sequence
            bus.publish("L1_IMU", message.encode() + bytes(3000))
            time.sleep(0.003)
        code, said = ended(process, None)
    assert code in (0, 3), said
    files = sorted(tmp_path.glob("a.lcmlog.*"))
    assert len(files) >= 3
    row = next(line.split() for line in said.splitlines() if line.strip().startswith("L1_IMU"))
    assert int(row[1]) + int(row[4]) == 1200
    assert all(recorded_config(file) is not None for file in files[:-1])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "there.lcmlog"], "exists; choose another name"),
        (["-o", "none/a.lcmlog"], "does not exist; make it first"),
        (["-o", "a.lcmlog", "--channels", "("], "not a regular expression"),
        (["-o", "a.lcmlog", "--config", "none.json"], "no such file"),
        (["-o", "a.lcmlog", "--split-mb", "0"], "allowed is 1 to"),
        (["-o", "a.lcmlog", "--keep-free-mb", "1e12"], "MB are free in FOLDER;"),
    ],
)
def test_what_cannot_work_is_refused_first(
    arguments: list[str], said: str, private_network: None, tmp_path: Path
) -> None:
    (tmp_path / "there.lcmlog").write_text("precious")
    command = [sys.executable, "-m", "ignis.record", *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 2 and said.replace("FOLDER", str(tmp_path)) in done.stderr, done.stderr
    assert (tmp_path / "there.lcmlog").read_text() == "precious"
    assert not (tmp_path / "a.lcmlog").exists()
