# SPDX-License-Identifier: Apache-2.0
"""What a user gets for wrong files and arguments: one clear sentence, a non-zero exit, nothing half-written."""

import json
import os
import socket
import subprocess
from pathlib import Path

import pytest

EXECUTABLES = [
    "l1_driver",
    "l1_tool",
    "l1_sim",
    "lio_frontend",
    "graph_backend",
    "graph_optimiser",
    "map_builder",
    "lio_replay",
]
REQUIRED = {"l1_sim": ["--scene", "none.json"], "l1_tool": ["version"]}


def refusal(done: subprocess.CompletedProcess, code: int) -> str:
    """The message of a refused run; checks its form."""
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr and "terminate called" not in done.stderr
    assert done.stderr.strip()
    return done.stderr


@pytest.mark.parametrize("name", EXECUTABLES)
def test_one_message_names_every_offence_of_a_configuration(name, run_binary, tmp_path: Path) -> None:
    config = tmp_path / "bad.json"
    config.write_text(json.dumps({"frontend": {"voxel_size_m": 0, "iterations": 1.5, "voxel_sice_m": 1}, "odd": {}}))
    message = refusal(run_binary(name, *REQUIRED.get(name, []), "--config", config), 2)
    for part in ("voxel_size_m = 0", "iterations = 1.5", 'did you mean "voxel_size_m"', "odd", "bad.json"):
        assert part in message


@pytest.mark.parametrize("name", EXECUTABLES)
def test_effective_configuration_is_printed_and_read_back(name, run_binary, tmp_path: Path) -> None:
    extra = REQUIRED.get(name, [])
    printed = run_binary(name, *extra, "--print-config")
    assert printed.returncode == 0, printed.stderr
    (tmp_path / "printed.json").write_text(printed.stdout)
    again = run_binary(name, *extra, "--config", tmp_path / "printed.json", "--print-config")
    assert again.stdout == printed.stdout


def test_assignments_win_over_the_file_and_are_checked_like_it(run_binary, tmp_path: Path) -> None:
    config = tmp_path / "file.json"
    config.write_text('{"frontend": {"iterations": 3, "voxel_size_m": 0.4}}')
    changes = ["--set", "frontend.iterations=7", "--set", "frontend.start=moving"]
    printed = run_binary("lio_replay", "--config", config, *changes, "--print-config")
    frontend = json.loads(printed.stdout)["frontend"]
    assert (frontend["iterations"], frontend["start"], frontend["voxel_size_m"]) == (7, "moving", 0.4)
    wrong = ["--set", "frontend.iterations=0", "--set", "frontend.voxel_sice_m=1", "--set", "nonsense"]
    message = refusal(run_binary("lio_replay", *wrong, "--print-config"), 2)
    for part in ("iterations = 0", 'did you mean "voxel_size_m"', "nonsense"):
        assert part in message


@pytest.mark.parametrize(("content", "expected"), [("", "not valid JSON"), ("{", "not valid JSON"), ("[]", "object")])
def test_broken_configuration_is_named(content: str, expected: str, run_binary, tmp_path: Path) -> None:
    config = tmp_path / "broken.json"
    config.write_text(content)
    message = refusal(run_binary("lio_frontend", "--config", config), 2)
    assert "broken.json" in message and expected in message


def test_missing_configuration_and_unknown_option_are_named(run_binary) -> None:
    assert "none.json: no such file" in refusal(run_binary("lio_frontend", "--config", "none.json"), 2)
    assert "--colour" in refusal(run_binary("lio_frontend", "--colour"), 2)


@pytest.mark.parametrize(
    ("content", "expected"), [(None, "no such file"), (b"", "is empty"), (b"x" * 5000, "is it an LCM log?")]
)
def test_replay_refuses_what_is_no_log(content: bytes | None, expected: str, run_binary, tmp_path: Path) -> None:
    log = tmp_path / "x.lcmlog"
    if content is not None:
        log.write_bytes(content)
    message = refusal(run_binary("lio_replay", log, "--out", tmp_path / "out"), 2)
    assert expected in message
    assert not (tmp_path / "out").exists()


def test_replay_lists_the_channels_of_a_foreign_log(run_binary, tmp_path: Path) -> None:
    import lcm

    log = lcm.EventLog(str(tmp_path / "foreign.lcmlog"), "w")
    for number in range(3):
        log.write_event(number, "CAMERA", b"12345678")
    log.close()
    message = refusal(run_binary("lio_replay", tmp_path / "foreign.lcmlog", "--out", tmp_path / "out"), 2)
    assert "L1_IMU" in message and "type 0x3132333435363738, which is none of ours" in message
    assert " ".join(message.split()).count("CAMERA 3 messages") == 1


def test_simulator_refuses_an_unknown_scene(run_binary, tmp_path: Path) -> None:
    message = refusal(run_binary("l1_sim", "--scene", "none.json", "--capture", tmp_path / "c.bin"), 2)
    assert "none.json" in message
    assert not list(tmp_path.iterdir())


def test_driver_says_what_to_do_about_its_port(run_binary, private_network) -> None:
    assert "/dev/no-such-port" in refusal(run_binary("l1_driver", "--port", "/dev/no-such-port"), 1)


def test_missing_multicast_route_is_named_with_the_command_that_makes_one(run_binary) -> None:
    script = 'exec unshare -n -- "$@"'
    binary = Path(os.environ["IGNIS_BUILD"]) / "bin" / "lio_frontend"
    done = subprocess.run(["/bin/bash", "-c", script, "_", binary], capture_output=True, text=True, timeout=30)
    assert "ip route add 224.0.0.0/4 dev lo" in refusal(done, 1)


def test_occupied_port_is_named(run_binary, private_network) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = run_binary("map_builder", "--port", port)
        assert done.returncode != 0
        assert str(port) in refusal(done, done.returncode)


@pytest.mark.parametrize("command", ["build", "test", "fuzz", "format", "lint"])
def test_entry_script_explains_a_command_without_starting_it(command: str) -> None:
    script = Path(os.environ["IGNIS_CHECKOUT"]) / "ignis"
    done = subprocess.run([script, command, "--help"], capture_output=True, text=True, timeout=5)
    assert done.returncode == 0 and not done.stderr
    (line,) = done.stdout.splitlines()
    assert command in line.split()


@pytest.mark.parametrize("arguments", [["nonsense"], ["import", "no-such-bag", "-o", "x.lcmlog"], ["compare", "none"]])
def test_entry_script_refuses_bad_arguments(arguments: list[str], tmp_path: Path) -> None:
    script = Path(os.environ["IGNIS_CHECKOUT"]) / "ignis"
    done = subprocess.run([script, *arguments], capture_output=True, text=True, timeout=60, cwd=tmp_path)
    refusal(done, 2)
    assert not list(tmp_path.iterdir())
