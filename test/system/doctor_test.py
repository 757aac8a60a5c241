# SPDX-License-Identifier: Apache-2.0
"""`./ignis doctor` before deliberately broken set-ups: each is found, with a severity and a command that mends it."""

import json
import os
import pty
import socket
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from pathlib import Path

import pytest
from vehicle_peers import Talker, health

from ignis.doctoring.data import check_data, check_inertial, hear
from ignis.doctoring.finding import EXIT_WARNINGS, Finding, Severity, exit_code
from ignis.doctoring.host import check_clock, check_disk, check_governor, check_receive_buffers
from ignis.doctoring.mount import check_mount
from ignis.doctoring.network import check_port as check_view_port
from ignis.doctoring.network import check_url, reaches_other_computers
from ignis.doctoring.sensor import check_sensor
from ignis.doctoring.software import check_jar, check_versions
from ignis.doctoring.synchronisation import check_synchronisation, read_kernel_clock

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
LISTEN_SECONDS = 2.0
ALL_FOUR = tuple(
    health(name, pid) for pid, name in enumerate(("l1_driver", "lio_frontend", "graph_backend", "map_builder"))
)


def worst(findings: Iterable[Finding]) -> Finding:
    """The finding that matters most; every one that is no praise must say how to mend it."""
    found = list(findings)
    for finding in found:
        assert finding.severity < Severity.WARNING or finding.fix, f"no fix for: {finding.text}"
    return max(found, key=lambda finding: finding.severity)


def listened(**talk: object) -> list[Finding]:
    with Talker(URL, **talk):
        return list(check_data(hear(URL, LISTEN_SECONDS)))


def proc(root: Path, **values: int) -> Path:
    folder = root / "proc/sys/net/core"
    folder.mkdir(parents=True)
    for name, value in values.items():
        (folder / name).write_text(f"{value}\n")
    return root


def test_healthy_stream_gives_no_complaint(private_network) -> None:
    assert worst(listened(healths=ALL_FOUR)).severity == Severity.OK


# --- host -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rmem_max", "rmem_default"])
def test_small_receive_buffers_are_found(name: str, tmp_path: Path) -> None:
    values = {"rmem_max": 8388608, "rmem_default": 8388608, name: 212992}
    finding = worst(check_receive_buffers(proc(tmp_path, **values)))
    assert finding.check == name and finding.severity == Severity.WARNING
    assert f"sysctl -w net.core.{name}=" in finding.fix


def test_large_receive_buffers_are_accepted(tmp_path: Path) -> None:
    found = list(check_receive_buffers(proc(tmp_path, rmem_max=8388608, rmem_default=2097152)))
    assert [f.severity for f in found] == [Severity.OK, Severity.OK]


def test_clock_before_the_build_is_found() -> None:
    assert check_clock(now=0.0, built=1.7e9).severity == Severity.ERROR
    assert check_clock(now=1.8e9, built=1.7e9).severity == Severity.OK


def test_clock_that_nobody_keeps_right_matters_between_computers() -> None:
    unsynchronised, synchronised = 0x0041, 0x2001
    severities = {
        (status, error, several): check_synchronisation(status, error, several_computers=several).severity
        for status, error in ((unsynchronised, 16.0), (synchronised, 0.2), (synchronised, 0.004))
        for several in (False, True)
    }
    assert list(severities.values()) == [
        *(Severity.NOTE, Severity.WARNING),
        *(Severity.OK, Severity.WARNING),
        *(Severity.OK, Severity.OK),
    ]
    assert worst([check_synchronisation(unsynchronised, 16.0, several_computers=True)]).fix
    assert reaches_other_computers(URL.replace("ttl=0", "ttl=1")) and not reaches_other_computers(URL)


def test_kernel_clock_is_read_without_rights() -> None:
    status, error = read_kernel_clock()
    assert 0 <= status < 1 << 17 and error >= 0.0


def test_full_disk_is_found(tmp_path: Path) -> None:
    severities = [check_disk(tmp_path, free).severity for free in (0.5e9, 5e9, 50e9)]
    assert severities == [Severity.ERROR, Severity.WARNING, Severity.OK]


def test_power_saving_governor_is_found(tmp_path: Path) -> None:
    assert check_governor(tmp_path).severity == Severity.OK
    for number, governor in enumerate(("performance", "powersave")):
        folder = tmp_path / f"sys/devices/system/cpu/cpu{number}/cpufreq"
        folder.mkdir(parents=True)
        (folder / "scaling_governor").write_text(governor + "\n")
    finding = check_governor(tmp_path)
    assert finding.severity == Severity.WARNING and "powersave" in finding.text


# --- bus --------------------------------------------------------------------------------------------------------------


def test_missing_receive_buffer_in_the_url_is_found() -> None:
    finding = worst(check_url("udpm://239.255.76.67:7667?ttl=0"))
    assert finding.severity == Severity.WARNING and "recv_buf_size=2097152" in finding.fix


def test_ttl_that_leaves_the_subnet_is_found() -> None:
    finding = worst(check_url(URL.replace("ttl=0", "ttl=5")))
    assert finding.check == "ttl" and finding.severity == Severity.WARNING


def test_url_whose_ttl_is_no_number_is_found() -> None:
    assert worst(check_url(URL.replace("ttl=0", "ttl=far"))).severity == Severity.ERROR


def in_namespace(script: str) -> Finding:
    """The worst finding of check_route in a fresh network namespace after `script`."""
    program = (
        "import json, sys; from ignis.doctoring.network import check_route;"
        "print(json.dumps([[f.check, int(f.severity), f.text, f.fix] for f in check_route(sys.argv[1])]))"
    )
    url = URL.replace("ttl=0", "ttl=1") if "# ttl 1" in script else URL
    flags = "-n" if os.geteuid() == 0 else "-rn"
    command = ["unshare", flags, "sh", "-c", f'{script}\nexec "$0" -c "$1" "$2"', sys.executable, program, url]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return worst(Finding("bus", c, Severity(s), text, fix) for c, s, text, fix in json.loads(printed))


def test_missing_multicast_route_is_found() -> None:
    finding = in_namespace("ip link set lo up")
    assert finding.severity == Severity.ERROR and "ip route add 224.0.0.0/4 dev lo" in finding.fix


def test_loopback_without_multicast_is_found() -> None:
    finding = in_namespace("ip link set lo up multicast off; ip route add 224.0.0.0/4 dev lo")
    assert finding.severity == Severity.ERROR and "multicast on" in finding.fix


def test_route_through_loopback_is_wrong_for_several_computers() -> None:
    finding = in_namespace("ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo # ttl 1")
    assert finding.severity == Severity.ERROR and "others hear nothing" in finding.text


def test_loopback_route_is_right_for_one_computer() -> None:
    finding = in_namespace("ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo")
    assert finding.severity == Severity.OK


def test_occupied_view_port_is_found() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        finding = check_view_port("127.0.0.1", other.getsockname()[1])
    assert finding.severity == Severity.ERROR and "ss -ltnp" in finding.fix


# --- sensor -----------------------------------------------------------------------------------------------------------


def test_missing_port_is_found() -> None:
    finding = worst(check_sensor("/dev/ttyNOWHERE", 2_000_000))
    assert finding.severity == Severity.ERROR and "does not exist" in finding.text


def test_wrong_baud_rate_is_found() -> None:
    near, far = pty.openpty()
    finding = worst(check_sensor(os.ttyname(far), 115200, driver_runs=True))
    os.close(near)
    os.close(far)
    assert finding.check == "baud" and finding.severity == Severity.ERROR


def test_plain_file_as_port_is_found(tmp_path: Path) -> None:
    (tmp_path / "port").touch()
    assert "no serial device" in worst(check_sensor(str(tmp_path / "port"), 2_000_000)).text


def test_port_that_another_program_holds_is_found() -> None:
    near, far = pty.openpty()
    name = os.ttyname(far)
    with subprocess.Popen(["sleep", "60"], stdin=far) as holder:
        try:
            finding = worst(check_sensor(name, 2_000_000))
        finally:
            holder.kill()
    os.close(near)
    os.close(far)
    assert finding.severity == Severity.ERROR and f"sleep ({holder.pid})" in finding.text


def test_forbidden_port_is_found() -> None:
    near, far = pty.openpty()
    name = os.ttyname(far)
    os.chmod(name, 0o600)
    program = (
        "import os, sys; os.setgid(65534); os.setuid(65534);"
        "from ignis.doctoring.sensor import check_sensor;"
        "print(max((f.severity, f.text, f.fix) for f in check_sensor(sys.argv[1], 2_000_000)))"
    )
    done = subprocess.run([sys.executable, "-c", program, name], capture_output=True, text=True, check=True)
    os.close(near)
    os.close(far)
    assert "may not be read and written" in done.stdout and "dialout" in done.stdout


# --- mount ------------------------------------------------------------------------------------------------------------


def mounts(**imu: object) -> dict:
    both = json.loads(CONFIG.read_text())["extrinsics"]
    both["imu"].update(imu)
    return both


def test_shipped_mount_is_plausible() -> None:
    assert worst(check_mount(mounts())).severity == Severity.OK


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pitch_deg": 45.0}, "turned by 90.0 degrees"),
        ({"translation_m": [0.5, 0.0, 0.0]}, "share a housing of 0.075 m"),
        ({"translation_m": [14.6, 10.2, 0.7]}, "millimetres instead of metres"),
    ],
)
def test_implausible_mount_is_found(change: dict, words: str) -> None:
    found = [f for f in check_mount(mounts(**change)) if f.severity == Severity.ERROR]
    assert any(words in f.text and f.fix for f in found)


# --- data -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("talk", "check", "severity", "words"),
    [
        ({"accel": (0.0, 1.0, 0.0)}, "gravity", Severity.ERROR, "the unit is g"),
        ({"accel": (0.0, 8.0, 0.0)}, "gravity", Severity.ERROR, "8.00 m/s^2 instead of 9.81"),
        ({"gyro": (0.0, 40.0, 0.0)}, "rest", Severity.ERROR, "degrees instead of radians"),
        ({"accel": (0.0, 7.586, -6.220)}, "mount angle", Severity.WARNING, "pitch +39.3"),
        ({"accel": (0.0, -9.81, 0.0)}, "mount angle", Severity.ERROR, "180.0 degrees off vertical"),
        ({"imu_hz": 100.0}, "L1_IMU", Severity.ERROR, "Hz instead of 250"),
        ({"lose_every": 50}, "L1_IMU", Severity.WARNING, "messages missing"),
        ({"points": 0}, "points", Severity.ERROR, "scans hold no points"),
        ({"age_s": 3600.0}, "stamps", Severity.WARNING, "from this computer's clock"),
        ({"healths": ALL_FOUR[:2]}, "processes", Severity.WARNING, "graph_backend, map_builder"),
        ({"healths": (*ALL_FOUR[:3], health("map_builder", 9, "bb"))}, "config_hash", Severity.ERROR, "map_builder bb"),
        ({"healths": (*ALL_FOUR[:3], health("map_builder", 9, state=3))}, "map_builder", Severity.ERROR, "is wrong"),
    ],
)
def test_broken_data_is_found(private_network, talk: dict, check: str, severity: Severity, words: str) -> None:
    found = {finding.check: finding for finding in listened(**{"healths": ALL_FOUR, **talk})}
    assert found[check].severity == severity, found[check]
    assert words in found[check].text and found[check].fix


def test_frozen_inertial_unit_is_found() -> None:
    import numpy as np

    accel = np.tile([0.0, 9.81, 0.0], (500, 1))
    assert "frozen" in worst(check_inertial(np.zeros((500, 3)), accel)).text


def test_driver_without_a_sensor_is_found(private_network) -> None:
    import lcm

    bus = lcm.LCM(URL)
    import threading

    timer = threading.Timer(0.5, lambda: bus.publish("HEALTH", ALL_FOUR[0].encode()))
    timer.start()
    found = {finding.check: finding for finding in check_data(hear(URL, LISTEN_SECONDS))}
    assert found["sensor data"].severity == Severity.ERROR and "l1 version" in found["sensor data"].fix


# --- software ---------------------------------------------------------------------------------------------------------


def test_missing_executable_is_found(tmp_path: Path) -> None:
    assert check_versions(tmp_path).severity == Severity.ERROR


def test_executables_of_several_versions_are_found(tmp_path: Path) -> None:
    from ignis.doctoring.software import EXECUTABLES

    for number, name in enumerate(EXECUTABLES):
        (tmp_path / name).write_text(f"#!/bin/sh\necho 0.{number}\n")
        (tmp_path / name).chmod(0o755)
    assert "several versions" in check_versions(tmp_path).text


def test_old_or_damaged_types_jar_is_found(tmp_path: Path) -> None:
    jar = tmp_path / "types.jar"
    assert check_jar(jar).severity == Severity.WARNING
    jar.write_bytes(b"no archive")
    assert check_jar(jar).severity == Severity.WARNING
    with zipfile.ZipFile(jar, "w") as archive:
        archive.writestr("ignis/imu_t.class", b"")
    assert "health_t" in check_jar(jar).text


# --- the command ------------------------------------------------------------------------------------------------------


def test_exit_code_is_that_of_the_first_part_to_mend() -> None:
    def finding(part: str, severity: Severity) -> Finding:
        return Finding(part, "x", severity, "x", "x")

    assert exit_code([finding("bus", Severity.OK), finding("data", Severity.NOTE)]) == 0
    assert exit_code([finding("data", Severity.WARNING)]) == EXIT_WARNINGS
    assert exit_code([finding("data", Severity.ERROR), finding("sensor", Severity.ERROR)]) == 13
    assert exit_code([finding("software", Severity.WARNING), finding("data", Severity.ERROR)]) == 15


def doctor(*arguments: object) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "ignis.doctor", "--seconds", "1", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def test_command_refuses_a_wrong_configuration_with_code_2(tmp_path: Path) -> None:
    assert doctor("--config", tmp_path / "none.json").returncode == 2
    (tmp_path / "wrong.json").write_text('{"frontend": {"voxel_size_m": -1}}')
    done = doctor("--config", tmp_path / "wrong.json")
    assert done.returncode == 2 and "voxel_size_m" in done.stderr


def test_command_names_the_missing_sensor_in_json_and_ends_with_its_code(private_network) -> None:
    done = doctor("--json", "--config", CONFIG, "--port", "/dev/ttyNOWHERE")
    report = json.loads(done.stdout)
    assert done.returncode == report["exit_code"] == 13, done.stdout
    assert any(f["part"] == "sensor" and f["severity"] == "ERROR" and f["fix"] for f in report["findings"])
