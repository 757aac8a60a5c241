# SPDX-License-Identifier: Apache-2.0
"""Row B3: a front end that is late for longer than its buffers last, and a kernel that gives it too little of them."""

import signal
from contextlib import ExitStack
from pathlib import Path

import ignis_lcm.ignis as types

from fault_drive import BUS, FaultRun
from ignis.logs import read_log
from slow_process import stopped_main_thread

SCAN_QUEUE = 10
SMALL_BUFFER = "recv_buf_size=524288"  # of the drive at twice its speed hardly a second
TOO_MUCH = 2**30
SLOW, SLOW_UNTIL = 1.8, 3.0  # [s] since the drive began, played at twice its speed
COUNTED = 4.3
FROZEN_UNTIL = 6.3


def small(url_option: str) -> str:
    return BUS.replace("recv_buf_size=2097152", url_option)


def lost_by(health: types.health_t) -> dict[str, int]:
    return dict(zip(health.channels, health.lost, strict=True))


def test_fault_b3_beyond_its_buffers_a_slow_receiver_keeps_the_imu_a_frozen_one_loses_what_comes_and_all_is_counted(
    drive_log: Path, tmp_path: Path
) -> None:
    sent = {
        channel: len({event.message.sequence for event in read_log(drive_log, (channel,))})
        for channel in ("L1_IMU", "L1_SCAN")
    }
    run = FaultRun(tmp_path, ("lio_frontend",), frontend_options=("--set", f"lcm.scan_queue={SCAN_QUEUE}"))
    run.pipeline.environment["LCM_DEFAULT_URL"] = small(SMALL_BUFFER)
    waiting = ["slow", "fast", "count", "freeze", "thaw"]
    counted: list[dict[str, int]] = []
    with run, ExitStack() as stopped:
        frontend = run.pipeline.processes["lio_frontend"]

        def meanwhile(seconds: float) -> None:
            due = {"slow": SLOW, "fast": SLOW_UNTIL, "count": COUNTED, "freeze": COUNTED, "thaw": FROZEN_UNTIL}
            if not waiting or seconds < due[waiting[0]]:
                return
            match waiting.pop(0):
                case "slow":
                    stopped.enter_context(stopped_main_thread(frontend.pid))
                case "fast":
                    stopped.close()
                case "count":
                    counted.append(lost_by(run.seen.health["lio_frontend"][-1]))
                case "freeze":
                    frontend.send_signal(signal.SIGSTOP)
                case "thaw":
                    frontend.send_signal(signal.SIGCONT)

        run.play(drive_log, meanwhile)
        told = run.seen.health["lio_frontend"]
    assert not waiting
    slow, final = counted[0], lost_by(told[-1])
    received = dict(zip(told[-1].channels, told[-1].received, strict=True))
    print(f"slow: {slow}, in the end: lost {final}, received {received} of {sent}")
    assert slow["L1_IMU"] == 0 and slow["L1_SCAN"] > SCAN_QUEUE, "scans go, the IMU stays"
    assert final["L1_IMU"] > 100 and final["L1_SCAN"] > slow["L1_SCAN"], "a kernel knows no channels"
    for channel, number in sent.items():  # what is lost at the very end nobody can count: no number comes behind it
        assert 0 <= number - received[channel] - final[channel] <= 10, channel
    for channel in sent:
        assert any(health.state != health.OK and f"{channel}: " in health.state_text for health in told), channel


def test_fault_b3_a_receive_buffer_that_the_kernel_does_not_give_is_told_at_the_start_and_no_fault(
    private_network: None, tmp_path: Path
) -> None:
    run = FaultRun(tmp_path)
    run.pipeline.environment["LCM_DEFAULT_URL"] = small(f"recv_buf_size={TOO_MUCH}")
    with run:
        for name, told in run.seen.health.items():
            said = run.pipeline.last_words(name, 20)
            assert f"of {TOO_MUCH} bytes" in said and "sudo sysctl -w net.core.rmem_max=" in said, (name, said)
            assert f"of {TOO_MUCH} bytes" in told[-1].state_text and told[-1].state != told[-1].FAULT, name
