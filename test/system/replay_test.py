# SPDX-License-Identifier: Apache-2.0
"""`./ignis replay` and what builds on it, over real logs: damaged, shuffled, foreign, with the configuration inside."""

import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import ignis_lcm.ignis as types
import nbformat
import numpy as np
import pyarrow.parquet
import pytest
from mcap.reader import make_reader
from nbclient import NotebookClient
from playwright.sync_api import sync_playwright

from ignis import read_log
from ignis.errors import EXIT_DAMAGED
from ignis.log_config import CONFIG_CHANNEL, encoded
from ignis.logs import LogWriter, read_events
from ignis.mounts import read_extrinsics
from ignis.pipeline import effective_config

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
SECONDS = "12"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two drives through the quick scene, straight into logs, with the truth inside."""
    folder = tmp_path_factory.mktemp("logs")
    made = []
    for seed in (1, 2):
        log = folder / f"seed{seed}.lcmlog"
        command = [Path(os.environ["IGNIS_BUILD"]) / "bin" / "l1_sim", "--scene", SCENE, "--config", CONFIG]
        command += ["--seed", str(seed), "--log", log, "--ground-truth", log.with_suffix(".tum")]
        subprocess.run(command, check=True, capture_output=True)
        made.append(log)
    return made


def ignis(module: str, *arguments: object, seconds: float = 120.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", f"ignis.{module}", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)


def report(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "report.json").read_text())
    return content


def replayed(log: Path, folder: Path, *arguments: object) -> dict[str, Any]:
    done = ignis("replay", log, "--config", CONFIG, "--out", folder, "--no-page", *arguments)
    assert done.returncode == 0, done.stderr
    return report(folder)


def test_until_ends_early_and_the_pace_is_kept(logs: list[Path], tmp_path: Path) -> None:
    began = time.monotonic()
    early = replayed(logs[0], tmp_path / "a", "--until", "3", "--speed", "1.5")
    assert time.monotonic() - began > 2.0
    assert early["duration_s"] == pytest.approx(3.0, abs=0.1)
    # The pace changes nothing in the results.
    fast = replayed(logs[0], tmp_path / "b", "--until", "3")
    assert fast["trajectory_hash"] == early["trajectory_hash"]
    assert fast["timing"]["wall_s"] < early["timing"]["wall_s"]


@pytest.mark.parametrize(("option", "said"), [("--speed=0", "--speed 0: allowed is max"), ("--until=0", "--until")])
def test_bad_options_end_before_anything_runs(option: str, said: str, logs: list[Path], tmp_path: Path) -> None:
    done = ignis("replay", logs[0], "--config", CONFIG, "--out", tmp_path / "a", option)
    assert done.returncode == 2 and said in done.stderr
    assert not (tmp_path / "a" / "report.json").exists()


def test_mounts_count_at_import_and_are_called_void_for_a_log(logs: list[Path], tmp_path: Path) -> None:
    moved = ["--set", "extrinsics.lidar.yaw_deg=90"]
    done = ignis("replay", logs[0], "--config", CONFIG, "--out", tmp_path / "a", "--no-page", "--until", "5", *moved)
    assert done.returncode == 0, done.stderr
    assert "in the body frame already; no effect has extrinsics.lidar.yaw_deg=90" in done.stderr
    capture = CHECKOUT / "test" / "data" / "l1" / "golden_clean.bin"
    points = []
    for name, more in (("straight", []), ("turned", moved)):
        done = ignis("importing", capture, "-o", tmp_path / name, "--config", CONFIG, *more)
        assert done.returncode == 0, done.stderr
        scan = read_log(tmp_path / name)["L1_SCAN"].ragged
        points.append(np.column_stack([np.concatenate(scan[axis]) for axis in "xyz"]))
    assert np.abs(points[1] - points[0]).max() > 1.0
    # 90 degrees to the left about up, at the sensor: forward (-Z) becomes left (-X).
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    origin = read_extrinsics(CONFIG).lidar.translation()
    np.testing.assert_allclose(points[1] - origin, (points[0] - origin) @ turn.T, atol=1e-4)


def test_a_shuffled_log_gives_the_same_bytes(logs: list[Path], tmp_path: Path) -> None:
    events = list(read_events(logs[0]))
    rng = random.Random(3)
    for start in range(0, len(events), 40):  # within 0.15 s, as load does it
        piece = events[start : start + 40]
        rng.shuffle(piece)
        events[start : start + 40] = piece
    with LogWriter(tmp_path / "shuffled.lcmlog") as writer:
        for event in events:
            writer.write(event.utime, event.channel, event.data)
    straight = replayed(logs[0], tmp_path / "a", "--until", SECONDS)
    shuffled = replayed(tmp_path / "shuffled.lcmlog", tmp_path / "b", "--until", SECONDS)
    assert shuffled["input"]["out_of_order"] > 1000 and straight["input"]["out_of_order"] == 0
    assert shuffled["input"]["first_drop"] is None
    assert shuffled["trajectory_hash"] == straight["trajectory_hash"]
    for name in ("eskf.tum", "scan_stats.csv", "map.ply", "keyframes.g2o"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_a_truncated_tail_and_a_gap_are_named_and_survived(logs: list[Path], tmp_path: Path) -> None:
    kept, skipped = [], 0
    for event in read_events(logs[0]):
        skipped += event.channel == "L1_IMU"
        if event.channel == "L1_IMU" and 1500 <= skipped < 1505:
            continue
        kept.append(event)
    log = tmp_path / "cut.lcmlog"
    with LogWriter(log) as writer:
        for event in kept[:5000]:
            writer.write(event.utime, event.channel, event.data)
    log.write_bytes(log.read_bytes()[:-7])
    done = ignis("replay", log, "--config", CONFIG, "--out", tmp_path / "a", "--no-page")
    assert done.returncode == 3, done.stderr  # results, but the input was damaged
    said = report(tmp_path / "a")["input"]
    assert said["missing_imu"] == 5 and said["damaged_bytes"] > 0
    assert said["first_drop"]["what"] == "5 of L1_IMU missing in the log"
    assert said["first_drop"]["s"] == pytest.approx(1498 / 250, abs=0.003)
    assert "first drop: at 5.99" in done.stdout


def test_a_whole_log_whose_numbers_have_gaps_ends_with_3_and_says_what_it_never_held(
    logs: list[Path], tmp_path: Path
) -> None:
    log = tmp_path / "gaps.lcmlog"
    with LogWriter(log) as writer:
        for number, event in enumerate(read_events(logs[0])):
            if number not in (2000, 2001) and not (event.channel == "L1_SCAN" and 3000 < number < 3100):
                writer.write(event.utime, event.channel, event.data)
    done = ignis("replay", log, "--config", CONFIG, "--out", tmp_path / "a", "--no-page", "--until", SECONDS)
    said = report(tmp_path / "a")["input"]
    assert said["damaged_bytes"] == said["undecodable"] == said["incomplete_scans"] == 0
    lost = f"{said['missing_imu']} IMU samples and {said['missing_scans']} scans by their running numbers"
    assert said["missing_imu"] > 0 and said["missing_scans"] > 0
    assert done.returncode == EXIT_DAMAGED and f"missing:    {lost}: the log never held them" in done.stdout


def test_the_page_says_in_words_what_was_refused(logs: list[Path], tmp_path: Path) -> None:
    bad = tmp_path / "bad.lcmlog"
    with LogWriter(bad) as writer:
        for number, event in enumerate(read_events(logs[0])):
            data = event.data
            if event.channel == "L1_IMU" and number in range(2000, 2010):
                sample = types.imu_t.decode(data)
                sample.gyro = [float("nan"), 0.0, 0.0]
                data = sample.encode()
            writer.write(event.utime, event.channel, data)
    for name, log in (("bad", bad), ("sound", logs[0])):
        done = ignis("replay", log, "--config", CONFIG, "--out", tmp_path / name / "run", "--until", SECONDS)
        assert done.returncode == 0, done.stderr
    count = report(tmp_path / "bad" / "run")["imu_rejected"]["not finite"]
    assert 0 < count <= 10
    words = (tmp_path / "bad" / "run" / "summary.html").read_text()
    assert f"IMU samples that the front end refused: {count} not finite." in words
    assert "Graph and map refused nothing." in words
    assert "that the front end refused" not in (tmp_path / "sound" / "run" / "summary.html").read_text()


def test_a_foreign_log_is_listed_and_refused(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "foreign.lcmlog") as writer:
        for index in range(20):
            writer.write(index, "POSE_BODY", b"\x12\x34\x56\x78\x9a\xbc\xde\xf0" + bytes(40))
            writer.write(index, "BATTERY", b"\x01\x02\x03\x04\x05\x06\x07\x08" + bytes(4))
    done = ignis("replay", tmp_path / "foreign.lcmlog", "--config", CONFIG, "--out", tmp_path / "a")
    assert done.returncode == 2 and "Traceback" not in done.stderr
    for part in ("POSE_BODY", "20 messages", "BATTERY", "0x123456789abcdef0", "none of ours", "L1_IMU"):
        assert part in done.stderr


def test_the_configuration_in_the_log_is_used_unless_another_is_given(logs: list[Path], tmp_path: Path) -> None:
    log = tmp_path / "with_config.lcmlog"
    recorded = effective_config(CONFIG)
    recorded["frontend"]["voxel_size_m"] = 0.123
    with LogWriter(log) as writer:
        writer.write(0, CONFIG_CHANNEL, encoded(recorded))
        for event in read_events(logs[0]):
            writer.write(event.utime, event.channel, event.data)
    done = ignis("replay", log, "--out", tmp_path / "a", "--until", "3", "--no-page")
    assert done.returncode == 0 and "the one recorded in the log" in done.stderr
    assert json.loads((tmp_path / "a" / "config.json").read_text())["frontend"]["voxel_size_m"] == 0.123
    done = ignis("replay", log, "--out", tmp_path / "b", "--until", "3", "--no-page", "--config", CONFIG)
    assert "differs from the recorded one in frontend.voxel_size_m\n" in done.stdout


def test_the_page_is_whole_in_a_browser_without_a_network(logs: list[Path], tmp_path: Path) -> None:
    done = ignis("replay", logs[0], "--config", CONFIG, "--out", tmp_path / "run", "--until", SECONDS)
    assert done.returncode == 0, done.stderr
    assert ignis("compare", tmp_path / "run").returncode == 0
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        for name, titles in (
            ("summary.html", ("Trajectories", "Error over time", "Loops", "Timings", "Biases", "Map", "Input")),
            ("compare.html", ("In words", "Errors", "How each figure is aligned")),
        ):
            asked.clear()
            page.goto(f"file://{tmp_path / 'run' / name}")
            found = page.locator("h2").all_inner_texts()
            assert all(any(text.startswith(title) for text in found) for title in titles), found
            sizes = page.locator("svg, img").evaluate_all("all => all.map(e => e.getBoundingClientRect().height)")
            assert len(sizes) >= 5 and min(sizes) > 100
            assert all(url.startswith(("file://", "data:")) for url in asked), asked
        browser.close()


def test_a_run_goes_out_as_mcap_and_as_a_bundle(logs: list[Path], tmp_path: Path) -> None:
    replayed(logs[0], tmp_path / "run", "--until", SECONDS)
    assert ignis("export", tmp_path / "run", "--to", "mcap", "-o", tmp_path / "run.mcap").returncode == 0
    with (tmp_path / "run.mcap").open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    assert summary is not None and summary.statistics is not None
    counts = {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()}
    scans = report(tmp_path / "run")["scans"]
    assert counts["/lio/pose"] == counts["/smoothed/pose"] > 0.8 * scans
    assert counts["/tf"] == 2 * counts["/lio/pose"] and counts["/map"] == counts["/graph"] == 1
    assert ignis("bundle", tmp_path / "run", "-o", tmp_path / "b.tar.gz").returncode == 0
    assert (tmp_path / "b.tar.gz").stat().st_size > 100_000


def test_the_example_notebook_runs(logs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replayed(logs[0], tmp_path / "run", "--until", "40")
    monkeypatch.setenv("IGNIS_EXAMPLE_LOG", str(logs[0]))
    monkeypatch.setenv("IGNIS_EXAMPLE_RUN", str(tmp_path / "run"))
    notebook = nbformat.read(CHECKOUT / "examples" / "look_at_a_drive.ipynb", as_version=4)
    NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 4
    assert any("ATE" in output.get("text", "") for output in outputs)


@pytest.fixture
def cluster(private_network: None, tmp_path: Path) -> Any:
    """A scheduler and two workers, each a process of its own, on this machine's loopback."""
    address = "tcp://127.0.0.1:18787"
    common = ["--no-dashboard", "--host", "127.0.0.1"]
    commands = [["dask", "scheduler", "--port", "18787", *common]]
    for name in ("one", "two"):
        local = ["--nthreads", "1", "--local-directory", str(tmp_path / name)]
        commands.append(["dask", "worker", address, "--name", name, *local, *common])
    processes = []
    for number, command in enumerate(commands):
        with (tmp_path / f"dask{number}.log").open("wb") as log:
            processes.append(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT))
    yield address
    for process in reversed(processes):
        process.terminate()
        process.wait(20)


def test_a_cluster_and_this_machine_give_identical_tables(logs: list[Path], cluster: str, tmp_path: Path) -> None:
    grid = [*logs, "--config", CONFIG, "--until", "8", "--set", "frontend.voxel_size_m=0.08,0.12"]
    local = ignis("sweep", *grid, "--out", tmp_path / "local", "--jobs", "2", seconds=300)
    assert local.returncode == 0, local.stderr
    for _ in range(40):  # The workers take a while to arrive.
        far = ignis("sweep", *grid, "--out", tmp_path / "far", "--engine", "dask", "--scheduler", cluster, seconds=300)
        if far.returncode == 0:
            break
        assert "no Dask scheduler answers" in far.stderr or "has no workers" in far.stderr, far.stderr
        time.sleep(0.5)
    for name in ("table.csv", "table.parquet"):
        assert (tmp_path / "local" / name).read_bytes() == (tmp_path / "far" / name).read_bytes(), name
    table = pyarrow.parquet.read_table(tmp_path / "far" / "table.parquet").to_pydict()
    assert table["status"] == ["ok"] * 4 and len(set(table["trajectory_hash"])) == 4
    assert all(value > 0.0 for value in table["eskf_ate_rmse_m"])
