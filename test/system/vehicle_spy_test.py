# SPDX-License-Identifier: Apache-2.0
"""`./ignis spy` on a display of its own: lcm-spy finds our types and shows the bus. The picture is for the docs."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from vehicle_peers import Talker, health

URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
PICTURE = os.environ.get("IGNIS_SPY_PICTURE")


def spy(**environment: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "ignis.spy", "--lcm-url", URL]
    base = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    return subprocess.run(command, capture_output=True, text=True, env={**base, **environment}, timeout=60)


def test_without_a_display_it_names_the_terminal_commands() -> None:
    done = spy()
    assert done.returncode == 2 and "./ignis echo" in done.stderr


def test_without_the_types_jar_it_says_how_to_make_it(tmp_path: Path) -> None:
    done = spy(DISPLAY=":1", IGNIS_JAR=str(tmp_path / "none.jar"))
    assert done.returncode == 2 and "./ignis build" in done.stderr


@pytest.mark.usefixtures("private_network")
def test_shows_the_bus_with_our_types(tmp_path: Path) -> None:
    assert shutil.which("Xvfb"), "Xvfb is one of the packages of the root"
    display = f":{90 + os.getpid() % 1000}"
    server = subprocess.Popen(
        ["Xvfb", display, "-screen", "0", "900x520x24", "-fbdir", str(tmp_path)], stderr=subprocess.DEVNULL
    )
    log = tmp_path / "spy.log"
    try:
        deadline = time.monotonic() + 20
        while not Path(f"/tmp/.X11-unix/X{display[1:]}").exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        with Talker(URL, healths=(health("l1_driver"),)), open(log, "wb") as output:
            command = [sys.executable, "-m", "ignis.spy", "--lcm-url", URL]
            shown = subprocess.Popen(
                command, stdout=output, stderr=output, env={**os.environ, "DISPLAY": display}, start_new_session=True
            )
            try:
                deadline = time.monotonic() + 60
                while "LCM types" not in log.read_text(errors="replace"):
                    assert shown.poll() is None and time.monotonic() < deadline, log.read_text(errors="replace")
                    time.sleep(0.2)
                time.sleep(12.0)
                assert shown.poll() is None, log.read_text(errors="replace")
                pixels = (tmp_path / "Xvfb_screen0").read_bytes()
            finally:
                shown.kill()
                shown.wait()
    finally:
        server.terminate()
        server.wait()
    said = log.read_text(errors="replace")
    print(said)
    types = len(list((Path(os.environ["IGNIS_CHECKOUT"]) / "lcmtypes").glob("*.lcm")))
    assert f"Found {types} LCM types" in said
    screen = pixels[-900 * 520 * 4 :]
    colours = len({screen[i : i + 4] for i in range(0, len(screen), 4)})
    assert colours > 20, "the screen is empty"
    if PICTURE:
        save_picture(pixels, Path(PICTURE))


def save_picture(dump: bytes, path: Path) -> None:
    """The screen's XWD dump as a PNG: 32 bits a pixel, blue first, behind the header."""
    import matplotlib.image
    import numpy as np

    screen = np.frombuffer(dump[-900 * 520 * 4 :], dtype=np.uint8).reshape(520, 900, 4)
    matplotlib.image.imsave(path, np.ascontiguousarray(screen[:, :, 2::-1]))
