# SPDX-License-Identifier: Apache-2.0
"""Every command that README, CONTRIBUTING and docs show is run here as it stands, or the table says why not."""

import os
import re
import shlex
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from vehicle_run import CONFIG, SCENE, simulated_vehicle

from ignis.pipeline import effective_config, enter_private_network

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
PAGES = [p for p in sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").rglob("*.md")]) if p.name != "CHANGELOG.md"]

# What cannot run in a test, by what the command holds, and why. A row that fits no command any more is an error.
NOT_RUN = {
    r"^sudo ": "changes the computer; the package's tests do it in a root of their own",
    r"ignis l1 (version|standby|normal|led)|mount-check": "needs a sensor; l1_tool_test has a simulated one",
    r"/dev/ttyUSB0": "needs a sensor",
    r"ignis (up|down)\b": "vehicle_test runs it with a simulated sensor",
    r"ignis status +#": "a live table until Ctrl-C; --once is run",
    r"ignis spy": "a window; vehicle_spy_test opens it",
    r"ignis (demo|build|test|lint|fuzz|sanitize|evaluate)\b": "minutes; CI runs it",
    r"ignis format": "changes the checkout",
    r"ignis reset": "ends the session under the other commands; reset_test runs it",
    r"ignis shell( +#|$)": "a shell for people",
    r"packaging/|vehicle_cost": "minutes, and needs root or the package",
    r"ignis bench|bench/|soak\.py": "minutes to an hour",
    r"backend_endurance|sweep a\.lcmlog|warehouse\.json +--out": "minutes",
    r"ADDRESS": "needs several computers",
    r"shared/data|drive\.bag|results/kitti": "needs recordings that not everybody has; other tests use them",
    r"[\[|]| FROM TO|GRAPH\.g2o|ignis graph": "a synopsis, or a command to a running back end (its own tests send it)",
    r"/var/lib": "writes to a folder of the system; backend_journal_test has one of its own",
}
# These go on until Ctrl-C.
ENDLESS = re.compile(r"ignis (run (map_builder|graph_backend|lio_frontend)|record|echo)\b")
ENDLESS_SECONDS = 8.0
# Exit codes that are an answer and no failure.
ANSWERS = {"doctor": {0, 9, 10, 11, 12, 13, 14, 15}, "status": {0, 1}}


def name(page: Path) -> str:
    """A page by its path in the checkout: two folders may have pages of one name."""
    return page.relative_to(CHECKOUT).as_posix()


def shown_commands() -> list[tuple[str, str]]:
    """Page and command line, in the order of the pages."""
    found = []
    for page in PAGES:
        fenced = False
        for line in page.read_text().replace("\\\n", " ").splitlines():
            if line.startswith("```"):
                fenced = not fenced
            command = line.strip()
            if (fenced or line.startswith(("    ", "\t"))) and re.match(r"(sudo |\./ignis |packaging/)", command):
                found.append((name(page), command))
    return found


def reason_not_to_run(command: str) -> str | None:
    """The table's word about a command."""
    bare = command.partition(" #")[0]
    return next((why for row, why in NOT_RUN.items() if re.search(row, command if "#" in row else bare)), None)


RUN = [(page, command) for page, command in shown_commands() if reason_not_to_run(command) is None]


def ignis(folder: Path, command: str) -> subprocess.Popen:
    """Starts a shown command in a folder, without its comment."""
    words = shlex.split(command, comments=True)
    words = [str(CHECKOUT / "ignis"), *(word for word in words[1:] if word != "&")]
    pattern = [str(path) for word in words for path in (sorted(folder.glob(word)) if "*" in word else [word])]
    # The vehicle's processes are on the bus already, and one of each is all that it takes.
    alone = enter_private_network if words[1] == "run" else None
    return subprocess.Popen(
        pattern,
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        preexec_fn=alone,
    )


@pytest.fixture(scope="module")
def scratch(private_network, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder that holds what the pages take for granted, while a simulated vehicle drives."""
    folder = tmp_path_factory.mktemp("docs")
    for place in (folder, *(folder / name(page) for page in PAGES)):
        place.mkdir(parents=True, exist_ok=True)
        (place / "config").symlink_to(CHECKOUT / "config")
    shutil.copy(CHECKOUT / "config" / "ignis8.json", folder / "other.json")
    shutil.copy(CHECKOUT / "config" / "schema.json", folder)
    simulate = [Path(os.environ["IGNIS_BUILD"]) / "bin" / "l1_sim", "--scene", SCENE, "--config", CONFIG]
    for output in ("--log", "drive.lcmlog"), ("--capture", "capture.bin"):
        line = [*simulate, "--duration", "14", *output, "--ground-truth", "truth.tum"]
        subprocess.run(line, cwd=folder, check=True, capture_output=True)
    shutil.copy(folder / "truth.tum", folder / "peer.tum")
    for drive in ("drive", "seed1", "seed2"):
        done = ignis(folder, f"./ignis replay drive.lcmlog --out results/{drive}")
        assert done.wait(120) == 0, done.communicate()[0]
    with simulated_vehicle(tmp_path_factory.mktemp("driving")):
        os.environ["LCM_DEFAULT_URL"] = effective_config(CONFIG)["lcm"]["url"]
        yield folder
        del os.environ["LCM_DEFAULT_URL"]


@pytest.mark.parametrize(("page", "command"), RUN, ids=lambda value: value[:50])
def test_command_runs_as_the_page_shows_it(scratch: Path, page: str, command: str) -> None:
    endless = bool(ENDLESS.search(command))
    # Recordings of two pages have the same name, and that of the drive.
    process = ignis(scratch / page if endless else scratch, command)
    try:
        output, _ = process.communicate(timeout=ENDLESS_SECONDS if endless else 180.0)
        answers = ANSWERS.get(shlex.split(command)[1], {0})
        assert process.returncode in answers, f"{page}: {command}\n{output}"
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=30.0)
        assert endless, f"{page}: {command}\n{output}"
        # A recording that missed datagrams, as on a machine short of time, says so and ends with 3.
        missed = {3} if "messages are missing by their running numbers" in output else set()
        assert process.returncode in {0, 130, -signal.SIGINT} | missed, f"{page}: {command}\n{output}"
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def test_every_row_of_the_table_has_its_command() -> None:
    commands = [command for _, command in shown_commands()]
    stale = [row for row in NOT_RUN if not any(re.search(row, command) for command in commands)]
    assert not stale and len(RUN) >= 15, (stale, len(RUN))
