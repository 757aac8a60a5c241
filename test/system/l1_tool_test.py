# SPDX-License-Identifier: Apache-2.0
"""What `l1` and `mount-check` tell about recordings, against the vendor's decoding and the simulator."""

import csv
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
GOLDEN = CHECKOUT / "test" / "data" / "l1"


def table(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_decode_gives_the_vendors_points_and_the_wires_samples(run_binary, tmp_path: Path) -> None:
    points, imu = tmp_path / "points.csv", tmp_path / "imu.csv"
    done = run_binary("l1_tool", "decode", GOLDEN / "golden_clean.bin", "-o", points, "--imu", imu)
    assert done.returncode == 0, done.stderr
    assert "36 pairs with 4169 points, 50 inertial samples" in done.stdout

    ours, theirs = table(points), table(GOLDEN / "golden_clean_points.csv")
    assert [(row["scan"], row["j"], row["intensity"]) for row in ours] == [
        (row["scan"], row["j"], row["intensity"]) for row in theirs
    ]
    distance = max(
        sum((float(a[axis]) - float(b[axis])) ** 2 for axis in "xyz") ** 0.5 for a, b in zip(ours, theirs, strict=True)
    )
    assert distance < 0.0002, f"{distance * 1000:.4f} mm"

    for a, b in zip(table(imu), table(GOLDEN / "golden_clean_imu.csv"), strict=True):
        assert a.keys() == b.keys()
        assert all(float(a[key]) == pytest.approx(float(b[key]), rel=2e-7, abs=1e-12) for key in a)


def test_decode_of_a_damaged_stream_leaves_holes_and_says_so(run_binary, tmp_path: Path) -> None:
    points, imu = tmp_path / "points.csv", tmp_path / "imu.csv"
    done = run_binary("l1_tool", "decode", GOLDEN / "golden_faults.bin", "-o", points, "--imu", imu)
    assert done.returncode == 3, done.stderr
    assert "3 pairs and 1 inertial samples missing" in done.stderr and "1 repeats" in done.stderr
    damaged = {"3", "5", "11"}
    expected = [row for row in table(GOLDEN / "golden_clean_points.csv") if row["scan"] not in damaged]
    assert [(row["scan"], row["j"]) for row in table(points)] == [(row["scan"], row["j"]) for row in expected]
    missing = {row["packet_id"] for row in table(GOLDEN / "golden_clean_imu.csv")} - {
        row["packet_id"] for row in table(imu)
    }
    assert missing == {"252"}  # the twelfth


@pytest.mark.parametrize(("stream", "code"), [("golden_clean.bin", 0), ("golden_faults.bin", 3)])
def test_a_capture_that_is_played_says_whether_it_is_damaged(stream, code, run_binary, tmp_path: Path) -> None:
    log = tmp_path / "played.lcmlog"
    done = run_binary("l1_driver", "--capture", GOLDEN / stream, "--lcm-url", f"file://{log}?mode=w")
    assert done.returncode == code, done.stderr
    assert ("3 pairs and 1 inertial samples missing" in done.stderr) == (code == 3)
    assert log.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["decode", GOLDEN / "README.md", "-o", "x.csv"], 3, "holds no frame of an L1"),
        (["decode", "none.bin", "-o", "x.csv"], 2, "cannot read none.bin"),
        (["decode", GOLDEN, "-o", "x.csv"], 2, "cannot read"),
        (["decode", GOLDEN / "golden_clean.bin"], 2, "-o POINTS.csv or --imu IMU.csv"),
        (["led", "9"], 2, "mode"),
        (["standby", "--port", "/dev/ttyIGNIS_none"], 1, "does not exist"),
        (["standby", "--port", "udp://1.2.3"], 1, "udp://ADDRESS:PORT"),
        ([], 2, "subcommand is required"),
    ],
)
def test_wrong_use_is_told_in_one_sentence(arguments, code, expected, run_binary, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = run_binary("l1_tool", *arguments)
    assert done.returncode == code, done.stderr
    assert expected in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def capture_at_rest(tmp_path_factory) -> Path:
    import subprocess

    from ignis.pipeline import binary

    capture = tmp_path_factory.mktemp("mount") / "capture.bin"
    scene = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
    subprocess.run(
        [binary("l1_sim"), "--scene", scene, "--duration", "4", "--capture", capture, "--config", config("ignis8")],
        check=True,
        capture_output=True,
    )
    return capture


def config(name: str) -> Path:
    return CHECKOUT / "config" / f"{name}.json"


def test_mount_check_confirms_the_mount_of_the_simulated_vehicle(capture_at_rest: Path, run_binary) -> None:
    done = run_binary(
        "l1_tool", "mount-check", "--seconds", "3", "--capture", capture_at_rest, "--config", config("ignis8")
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(" ok\n") == 2
    assert "agree with the configuration" in done.stdout


def test_mount_check_tells_the_true_angles_of_a_wrong_configuration(
    capture_at_rest: Path, run_binary, tmp_path: Path
) -> None:
    import json

    wrong = json.loads(config("ignis8").read_text())
    wrong["extrinsics"]["lidar"]["pitch_deg"] = -40.0
    wrong["extrinsics"]["imu"]["pitch_deg"] = -40.0
    (tmp_path / "wrong.json").write_text(json.dumps(wrong))
    done = run_binary(
        "l1_tool", "mount-check", "--seconds", "3", "--capture", capture_at_rest, "--config", tmp_path / "wrong.json"
    )
    assert done.returncode == 1, done.stdout + done.stderr
    gravity = next(line for line in done.stdout.splitlines() if line.startswith("gravity"))
    assert "CHECK" in gravity and float(gravity.split()[3]) == pytest.approx(-45.0, abs=0.8)
    assert "something does not agree" in done.stdout
