# SPDX-License-Identifier: Apache-2.0
"""Documentation: generated pages are current, links lead somewhere, commands exist with the options that are shown."""

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
PAGES = sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").rglob("*.md")])
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#+\s+(.*)$", re.MULTILINE)
# What only its own program may explain, or what does something when asked for help.
_WITHOUT_HELP = {"help", "shell"}


def anchor(heading: str) -> str:
    """The name that a heading gets in a link."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def test_generated_pages_are_current() -> None:
    done = subprocess.run([CHECKOUT / "docs" / "generate", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(CHECKOUT).as_posix())
def test_links_lead_to_files_and_headings_that_exist(page: Path) -> None:
    for link in _LINK.findall(page.read_text()):
        if "://" in link:
            continue
        name, _, wanted = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), f"{page.name}: {link}"
        if wanted and target.suffix == ".md":
            assert wanted in {anchor(h) for h in _HEADING.findall(target.read_text())}, f"{page.name}: {link}"


def shown_commands() -> dict[str, set[str]]:
    """Options of each `./ignis` command that a command block of README or docs shows."""
    shown: dict[str, set[str]] = {}
    for page in PAGES:
        if page.name == "CHANGELOG.md":
            continue
        for line in page.read_text().replace("\\\n", " ").splitlines():
            if not (found := re.match(r"^(?:    |\t)(?:sudo )?\./ignis (\S.*)$", line)):
                continue
            words = shlex.split(found[1].partition("#")[0].partition("|")[0].rstrip("& "))
            name = " ".join(words[:2]) if words[0] in ("run", "graph", "l1") else words[0]
            shown.setdefault(name, set()).update(w.partition("=")[0] for w in words if w.startswith("--") and w != "--")
    return shown


@pytest.mark.parametrize(("name", "options"), sorted(shown_commands().items()))
def test_commands_in_the_docs_exist_with_the_options_shown(name: str, options: set[str]) -> None:
    if name in _WITHOUT_HELP:
        assert re.search(rf"\b{name}\b", (CHECKOUT / "ignis").read_text())
        return
    done = subprocess.run([CHECKOUT / "ignis", *name.split(), "--help"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    known = done.stdout
    if name.split()[0] in ("l1", "mount-check"):
        # Options of l1_tool itself may stand behind its commands.
        known += subprocess.run([CHECKOUT / "ignis", "l1", "--help"], capture_output=True, text=True).stdout
    missing = {option for option in options if option not in known}
    assert not missing, f"./ignis {name} does not know {missing}"
