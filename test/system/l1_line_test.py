# SPDX-License-Identifier: Apache-2.0
"""The real driver on the line of the simulated sensor: over a serial port (pty) and over UDP, both ways."""

import fcntl
import itertools
import os
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ignis.logs import TypedEvent, read_log
from ignis.pipeline import Pipeline, effective_config
from pty_relay import PtyRelay

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
ADDRESS = "127.0.0.1:5000"
SECONDS = 20
FIRMWARE = "1.0.1+230601"
# The clock fit begins with nothing; its stamps are judged from here on.
SETTLED_US = 1_000_000

# Captured from the vendor's library.
STANDBY = bytes.fromhex("fd 01 00 00 00 01 01 0e 00 00 02 ed 78")
NORMAL = bytes.fromhex("fd 01 00 00 00 01 01 0e 00 00 01 85 52")


class Recording:
    """What was on the bus during a run."""

    def __init__(self, log: Path) -> None:
        self.events: list[TypedEvent] = list(read_log(log))

    def on(self, channel: str) -> list[TypedEvent]:
        """Events of one channel in order of their arrival."""
        return [event for event in self.events if event.channel == channel]

    def messages(self, channel: str) -> list[Any]:
        """Their messages."""
        return [event.message for event in self.on(channel)]

    def scans(self) -> list[TypedEvent]:
        """First parts only: one event per scan."""
        return [event for event in self.on("L1_SCAN") if event.message.part == 0]

    def driver_health(self) -> list[TypedEvent]:
        """HEALTH of the driver."""
        return [event for event in self.on("HEALTH") if event.message.process == "l1_driver"]


class Bench:
    """Driver, sensor and recorder of one test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = folder / "l1.pty"
        self.pipeline = Pipeline(folder, effective_config(CONFIG)["lcm"]["url"])
        self._log = folder / "bus.lcmlog"
        self.pipeline.start("lcm-logger", "--quiet", self._log)

    def start_driver(self, port: object, *arguments: object) -> None:
        self.pipeline.start("l1_driver", "--config", CONFIG, "--port", port, *arguments)
        self.pipeline.wait_for_text("l1_driver", "reading", 20.0)

    def start_sensor(self, *arguments: object) -> None:
        """On the serial port, waiting for its reader."""
        self.pipeline.start(
            "l1_sim", "--scene", SCENE, "--config", CONFIG, "--pty", self.port, "--wait", 30, *arguments
        )
        self.pipeline.wait_for_text("l1_sim", "waiting", 20.0)

    def start_sensor_on_udp(self, *arguments: object) -> None:
        self.pipeline.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--udp", ADDRESS, *arguments)

    def wait_for_end_of_sensor(self) -> str:
        """What it said."""
        code = self.pipeline.processes["l1_sim"].wait(120)
        words = self.pipeline.last_words("l1_sim", 20)
        assert code == 0, words
        return words

    def recording(self) -> Recording:
        """Ends driver and recorder."""
        time.sleep(0.5)
        self.pipeline.stop("l1_driver", "l1_sim", "lcm-logger")
        return Recording(self._log)


@pytest.fixture
def bench(private_network, tmp_path: Path):
    made = Bench(tmp_path)
    with made.pipeline:
        yield made


@pytest.fixture(scope="module", params=["pty", "udp"])
def drive(request, private_network, tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, str]:
    """An undisturbed drive: the recording, and what the sensor said at its end."""
    made = Bench(tmp_path_factory.mktemp(f"line_{request.param}"))
    with made.pipeline:
        if request.param == "pty":
            made.start_sensor("--duration", SECONDS)
            made.start_driver(made.port)
        else:
            made.start_driver(f"udp://{ADDRESS}")
            made.start_sensor_on_udp("--duration", SECONDS)
        words = made.wait_for_end_of_sensor()
        return made.recording(), words


def _stamp_errors_us(recording: Recording) -> np.ndarray:
    """Of the k-th sample against the k-th true instant, once the clock fit has settled."""
    truth = {message.sequence: message.utime for message in recording.messages("GROUND_TRUTH")}
    samples = [message for message in recording.messages("L1_IMU") if message.sequence in truth]
    errors = np.array([message.utime - truth[message.sequence] for message in samples])
    return errors[SETTLED_US // 4000 :]


def _show(name: str, errors: np.ndarray) -> None:
    print(
        f"{name}: stamp error of {len(errors)} samples: median {np.median(errors):.0f} us, "
        f"median of magnitude {np.median(np.abs(errors)):.0f} us, largest {np.abs(errors).max():.0f} us"
    )


def _assert_stamps_increase(events: list[TypedEvent]) -> None:
    stamps = [event.message.utime for event in events]
    assert all(a < b for a, b in itertools.pairwise(stamps))


def test_every_sample_and_scan_arrives(drive: tuple[Recording, str]) -> None:
    recording, words = drive
    # By the driver's own count: a recorder that did not get the processor loses what was published.
    status = recording.messages("L1_STATUS")[-1]
    assert status.imu_published == SECONDS * 250 + 1
    assert abs(status.scans_published - SECONDS * 20) <= 1
    assert sum(event.message.missing_packets for event in recording.scans()) == 0
    assert (status.imu_gaps, status.scan_gaps, status.duplicates, status.crc_errors, status.skipped_bytes) == (0,) * 5
    assert "; 0 frames found no reader" in words


def test_sensor_and_driver_talk(drive: tuple[Recording, str]) -> None:
    recording, words = drive
    assert recording.messages("L1_STATUS")[-1].firmware == FIRMWARE
    assert f"{SECONDS} time-sync answers" in words
    assert "0 unknown messages, 0 broken frames, 0 bytes outside frames" in words
    assert " 0 version queries" not in words


def test_stamps_are_those_of_the_measurements(drive: tuple[Recording, str], request) -> None:
    recording, _ = drive
    errors = _stamp_errors_us(recording)
    _show(request.node.name, errors)
    assert np.median(np.abs(errors)) < 500
    assert np.abs(errors).max() < 2000
    _assert_stamps_increase(recording.on("L1_IMU"))
    _assert_stamps_increase(recording.scans())


def test_stamps_hold_when_the_reading_loop_jitters(bench: Bench, tmp_path: Path) -> None:
    bench.start_sensor("--duration", SECONDS)
    with PtyRelay(bench.port, tmp_path / "relayed.pty", most_delay_s=2e-3):
        bench.start_driver(tmp_path / "relayed.pty")
        bench.wait_for_end_of_sensor()
        recording = bench.recording()
    errors = _stamp_errors_us(recording)
    _show("0 to 2 ms of delay", errors)
    assert np.median(np.abs(errors)) < 1000
    assert np.abs(errors).max() < 2000


@pytest.mark.parametrize("process", ["l1_driver", "l1_sim"])
def test_stamps_hold_when_a_process_stands_still_for_two_seconds(bench: Bench, process: str) -> None:
    bench.start_driver(f"udp://{ADDRESS}")
    bench.start_sensor_on_udp("--duration", 10)
    time.sleep(4.0)
    bench.pipeline.processes[process].send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    bench.pipeline.processes[process].send_signal(signal.SIGCONT)
    bench.wait_for_end_of_sensor()
    recording = bench.recording()
    assert recording.messages("L1_STATUS")[-1].imu_published == 10 * 250 + 1
    # What waited came at once and late; that says nothing about when it was measured.
    errors = _stamp_errors_us(recording)
    _show(f"{process} stood still", errors)
    assert np.abs(errors).max() < 2000


def test_driver_comes_back_with_the_cable(bench: Bench) -> None:
    bench.start_sensor("--duration", 60)
    bench.start_driver(bench.port)
    time.sleep(3.0)
    bench.pipeline.stop("l1_sim")
    pulled = time.time() * 1e6
    time.sleep(2.0)
    bench.start_sensor("--duration", 60)
    returned = bench.port.lstat().st_ctime_ns * 1e-3
    time.sleep(3.0)
    recording = bench.recording()

    meanwhile = [e.message for e in recording.driver_health() if pulled + 0.3e6 < e.utime < returned]
    assert meanwhile and all(message.state == message.FAULT for message in meanwhile)
    assert str(bench.port) in meanwhile[-1].state_text
    after = [event for event in recording.on("L1_IMU") if event.utime > returned]
    assert len(after) > 400
    assert after[0].utime - returned < 1e6
    assert any(e.utime > returned and e.message.state == e.message.OK for e in recording.driver_health())
    _assert_stamps_increase(recording.on("L1_IMU"))
    _assert_stamps_increase(recording.scans())


def test_fault_d6_a_port_that_comes_back_busy_is_not_called_gone(bench: Bench) -> None:
    bench.start_sensor("--duration", 60)
    bench.start_driver(bench.port)
    time.sleep(1.0)
    bench.pipeline.stop("l1_sim")
    sensor, other_reader = os.openpty()
    fcntl.flock(other_reader, fcntl.LOCK_EX)
    bench.port.unlink(missing_ok=True)
    bench.port.symlink_to(os.ttyname(other_reader))
    time.sleep(1.5)
    words = bench.pipeline.last_words("l1_driver")
    told = bench.recording().driver_health()[-1].message
    os.close(sensor)
    os.close(other_reader)
    assert told.state == told.FAULT and "in use by another process" in told.state_text
    assert f"{bench.port} at 2000000 baud" in told.state_text and "is gone" not in told.state_text
    assert words.count("in use by another process") == 1, "the log tells each reason once"


def test_standby_stops_the_scans_and_normal_brings_them_back(bench: Bench, tmp_path: Path) -> None:
    bench.start_sensor("--duration", 60, "--spin-up", 1.0)
    told = []
    with PtyRelay(bench.port, tmp_path / "relayed.pty") as relay:
        bench.start_driver(tmp_path / "relayed.pty")
        for command in (STANDBY, NORMAL):
            time.sleep(3.0)
            told.append(time.time() * 1e6)
            relay.tell_sensor(command)
        time.sleep(4.0)
        recording = bench.recording()

    standby_at, normal_at = told
    scans = recording.scans()
    assert not [event for event in scans if standby_at + 0.3e6 < event.utime < normal_at + 1.0e6]
    resumed = [event for event in scans if event.utime > normal_at]
    assert resumed[0].utime - normal_at < 1.5e6
    assert len(resumed) > 40
    texts = [e.message.state_text for e in recording.driver_health() if standby_at + 1.5e6 < e.utime < normal_at]
    assert texts and all("standby" in text for text in texts)
    samples = [event for event in recording.on("L1_IMU") if standby_at < event.utime < normal_at]
    assert len(samples) > 0.95 * 250 * (normal_at - standby_at) * 1e-6
    assert recording.messages("L1_STATUS")[-1].imu_gaps == 0
    _assert_stamps_increase(scans)
    # The first scan after the spin-up was measured after it, whatever its counter says.
    for event in resumed:
        assert abs(event.utime - (event.message.utime + event.message.duration_us)) < 0.3e6


def test_bad_line_costs_what_it_hits_and_no_more(bench: Bench) -> None:
    rates = {"drop": 0.01, "flip": 0.01, "cut": 0.005, "duplicate": 0.01, "reorder": 0.002, "junk": 0.01}
    faults = [word for name, rate in rates.items() for word in ("--fault", f"{name}={rate}")]
    bench.start_sensor("--duration", SECONDS, *faults, "--fault", "stall=0.0003", "--stall-ms", 80)
    bench.start_driver(bench.port)
    words = bench.wait_for_end_of_sensor()
    recording = bench.recording()
    injected = {kind: int(count) for count, kind in re.findall(r"(\d+) (\w+)", words.partition("injected: ")[2])}
    assert set(injected) >= set(rates) and injected["stall"] >= 1, words

    samples = recording.on("L1_IMU")
    lost_frames = injected["drop"] + injected["flip"] + injected["cut"]
    status = recording.messages("L1_STATUS")[-1]
    missing = SECONDS * 250 + 1 - status.imu_published
    assert 0 < missing <= lost_frames + injected["reorder"]
    assert abs(status.imu_gaps - missing) <= 2  # the counter does not tell what is missing at the end
    assert status.duplicates > 0 and status.crc_errors > 0 and status.skipped_bytes > 0
    _assert_stamps_increase(samples)
    _assert_stamps_increase(recording.scans())
    truth = recording.messages("GROUND_TRUTH")[0]
    passed = np.array([event.message.utime for event in samples]) - (truth.utime - 4000 * truth.sequence)
    errors = (passed[passed > SETTLED_US] + 2000) % 4000 - 2000
    _show("bad line, against the nearest sample", errors)
    assert np.abs(errors).max() < 1000


def _frame(message_id: int, crc_extra: int, payload: bytes) -> bytes:
    """A MAVLink 2 frame of a host: sequence 0, system 1, component 1."""
    body = bytes([len(payload), 0, 0, 0, 1, 1, message_id, 0, 0]) + payload
    crc = 0xFFFF
    for byte in body + bytes([crc_extra]):
        mixed = (byte ^ crc) & 0xFF
        mixed = (mixed ^ (mixed << 4)) & 0xFF
        crc = (crc >> 8) ^ (mixed << 8) ^ (mixed << 3) ^ (mixed >> 4)
        crc &= 0xFFFF
    return b"\xfd" + body + crc.to_bytes(2, "little")


def test_sensor_denounces_a_host_that_would_spoil_its_calibration(bench: Bench) -> None:
    assert _frame(14, 84, b"\x02") == STANDBY
    bench.start_sensor("--duration", 2)
    host = os.open(bench.port, os.O_RDWR | os.O_NOCTTY)
    try:
        os.write(host, _frame(123, 10, bytes(60) + b"\x01") + _frame(124, 68, bytes(43) + b"\x01"))
        deadline = time.monotonic() + 20
        while bench.pipeline.processes["l1_sim"].poll() is None and time.monotonic() < deadline:
            os.read(host, 4096)
    except OSError:
        pass  # the sensor has closed its end
    finally:
        os.close(host)
    assert bench.pipeline.processes["l1_sim"].wait(20) == 1
    assert "2 messages 123 or 124" in bench.pipeline.last_words("l1_sim")


@pytest.fixture
def ask(run_binary: Callable, bench: Bench) -> Callable[..., str]:
    """Runs l1_tool on the bench's port; returns what it printed."""

    def run(*command: object) -> str:
        done = run_binary("l1_tool", "--config", CONFIG, "--port", bench.port, *command, seconds=30)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_commands_reach_a_sensor_that_ignores_some(bench: Bench, ask: Callable[..., str]) -> None:
    bench.start_sensor("--duration", 60, "--ignore-commands", 0.7, "--spin-up", 0.5)
    assert FIRMWARE in ask("version")
    ask("led", 3)
    ask("standby")
    ask("normal")
    words = bench.pipeline.last_words("l1_sim", 40)
    assert "LED mode 3" in words
    assert words.index("standby") < words.index("normal mode")


def _clock_epochs(recording: Recording) -> dict[int, float]:
    """When [us] each was announced first, in this order."""
    announced: dict[int, float] = {}
    for event in recording.on("L1_STATUS"):
        announced.setdefault(event.message.clock_epoch, event.utime)
    return announced


def test_power_cycle_and_early_wrap_are_survived(bench: Bench) -> None:
    bench.start_sensor("--duration", 12, "--power-cycle-at", 6, "--power-off", 2, "--id-modulus", 1024)
    bench.start_driver(bench.port)
    bench.wait_for_end_of_sensor()
    recording = bench.recording()
    samples = recording.on("L1_IMU")
    resumed = next(b for a, b in itertools.pairwise(samples) if b.utime - a.utime > 1e6)
    first, second = list(epochs := _clock_epochs(recording))[:2]
    assert second > first and abs(epochs[second] - resumed.utime) < 1e6
    assert recording.messages("L1_STATUS")[-1].imu_published == 10 * 250 + 1
    errors = _stamp_errors_us(recording)
    _show("power cycle", errors)
    assert np.abs(errors).max() < 20_000
    _assert_stamps_increase(samples)
    _assert_stamps_increase(recording.scans())


def test_fault_p1_a_driver_that_is_killed_is_followed_by_another_clock_epoch(bench: Bench) -> None:
    bench.start_sensor("--duration", 60)
    for _ in range(2):
        bench.start_driver(bench.port)
        time.sleep(2.0)
        bench.pipeline.processes["l1_driver"].kill()
        bench.pipeline.processes["l1_driver"].wait()
    first, second = _clock_epochs(bench.recording())
    assert second > first, "no epoch is announced twice"


def test_raw_recording_decodes_to_what_was_published(bench: Bench, run_binary: Callable[..., Any]) -> None:
    raw, log = bench.folder / "raw.bin", bench.folder / "decoded.lcmlog"
    bench.start_sensor("--duration", 6)
    bench.start_driver(bench.port, "--record", raw)
    bench.wait_for_end_of_sensor()
    recording = bench.recording()

    assert (
        run_binary("l1_driver", "--capture", raw, "--config", CONFIG, "--lcm-url", f"file://{log}?mode=w").returncode
        == 0
    )
    again = Recording(log)
    forces = [tuple(message.accel) for message in again.messages("L1_IMU")]
    assert len(forces) > 1400
    assert forces == [tuple(message.accel) for message in recording.messages("L1_IMU")]
    assert "exists already" in run_binary("l1_driver", "--port", bench.port, "--record", raw).stderr
