# SPDX-License-Identifier: Apache-2.0
"""`./ignis up` without systemd in a simulated drive: each process killed in turn is restarted, the drive goes on."""

import json
import time
import urllib.request
from collections.abc import Iterator

import pytest
from vehicle_peers import health
from vehicle_run import BACK_WITHIN_S, CONFIG, OUTPUTS, PORT, VICTIMS, Vehicle, command, simulated_vehicle

from ignis.bus import Listener
from ignis.pipeline import effective_config
from ignis.status import all_well, disagreements, page


@pytest.fixture(scope="module")
def vehicle(private_network, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Vehicle]:
    """A drive in which every process was killed once; the simulated sensor goes on all the time."""
    with simulated_vehicle(tmp_path_factory.mktemp("vehicle")) as driven:
        for victim in VICTIMS:
            driven.seconds[victim] = driven.kill(victim, OUTPUTS[victim])
            driven.listener.listen(4.0)
        for _ in range(2):
            driven.driver_gaps.append(driven.gap_of_killed_driver())
            driven.listener.listen(1.5)  # what has lived for less than a second is started a second later
        driven.listener.listen(3.0)
        yield driven


def test_every_killed_process_is_back_and_its_output_flows(vehicle: Vehicle) -> None:
    print({name: round(seconds, 2) for name, seconds in vehicle.seconds.items()})
    assert set(vehicle.seconds) == set(VICTIMS)
    assert all(seconds < BACK_WITHIN_S for seconds in vehicle.seconds.values())
    # A busy machine may delay one of them.
    assert min(vehicle.driver_gaps) < 0.5, vehicle.driver_gaps
    assert vehicle.seconds["lio_frontend"] < 2.0 and vehicle.health("lio_frontend").resets == 0


def test_map_and_graph_go_on_after_the_kills(vehicle: Vehicle) -> None:
    with urllib.request.urlopen(f"http://127.0.0.1:{PORT}/api/status", timeout=10) as answer:
        assert json.load(answer)

    def same_keyframes() -> bool:
        in_graph = vehicle.listener.channels["SMOOTHED_KEYFRAMES"].newest.graph_keyframes
        in_map = vehicle.listener.channels["MAP_STATUS"].newest.keyframes
        return in_map >= in_graph > 0

    # The map's successor has asked the front end for every keyframe of the session again.
    vehicle.wait(same_keyframes, 15.0)
    assert vehicle.listener.channels["MAP_STATUS"].newest.voxels_local > 1000
    assert vehicle.health("lio_frontend").state in (0, 1)


def test_health_tells_use_against_the_declared_limits(vehicle: Vehicle) -> None:
    for process in VICTIMS:
        message = vehicle.health(process)
        limits = effective_config(CONFIG)["health"][process]
        assert message.memory_limit_mb == limits["memory_mb"] and message.cpu_limit_percent == limits["cpu_percent"]
        assert 1.0 < message.memory_mb < limits["memory_mb"]
        assert message.progress > 0 and message.config_hash and message.version
    assert sum(vehicle.health(process).cpu_percent for process in VICTIMS) > 0.5


def test_processes_agree_about_their_configuration(vehicle: Vehicle) -> None:
    assert len({vehicle.health(process).config_hash for process in VICTIMS}) == 1


def test_status_shows_all_processes(vehicle: Vehicle) -> None:
    shown = command("status", "--once").stdout
    print(shown)
    for word in (*VICTIMS, "LIO_STATE", "L1_IMU"):
        assert word in shown


def test_echo_and_hz_show_the_bus(vehicle: Vehicle) -> None:
    echoed = command("echo", "LIO_STATE", "--json", "-n", 2, "--seconds", 20)
    assert echoed.returncode == 0 and len(echoed.stdout.splitlines()) == 2
    assert len(json.loads(echoed.stdout.splitlines()[0])["position"]) == 3
    shown = command("hz", "--seconds", 2).stdout
    assert "state_t" in shown and "HEALTH" in shown
    assert command("echo", "NO_SUCH_CHANNEL", "--seconds", 0.5).returncode == 1


def test_second_up_is_refused(vehicle: Vehicle) -> None:
    again = command("up", "--config", CONFIG, "--state", vehicle.folder / "state")
    assert again.returncode == 2 and "already up" in again.stderr


def test_status_counts_a_disagreement_and_a_missing_process_as_not_well(private_network) -> None:
    listener = Listener("memq://")
    now = time.monotonic()
    for pid, name in enumerate(VICTIMS):
        listener.health[(name, pid)] = (now, health(name, pid))
    assert all_well(listener) and disagreements(listener) == []
    listener.health[("ignis_record", 9)] = (now, health("ignis_record", 9, config_hash="", version=""))
    assert all_well(listener), "a tool that names no configuration contradicts nobody"
    listener.health[("map_builder", 3)] = (now, health("map_builder", 3, config_hash="bb"))
    assert not all_well(listener) and "map_builder bb" in disagreements(listener)[0]
    listener.health[("map_builder", 3)] = (now - 5.0, health("map_builder", 3))
    assert not all_well(listener) and "GONE" in page(listener, colour=False)
