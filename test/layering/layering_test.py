# SPDX-License-Identifier: Apache-2.0
"""The direction of includes, as DESIGN draws it: common <- cores <- messages <- apps."""

import re
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
CORES = {"drivers", "frontend", "backend", "map"}
MAY_INCLUDE = {
    "common": {"common"},
    **{core: {"common", core} for core in CORES},
    "messages": {"common", "messages", *CORES},
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def includes_of(folder: str) -> list[tuple[Path, str]]:
    files = [f for f in (CHECKOUT / "src" / folder).rglob("*") if f.suffix in {".h", ".cpp"}]
    assert files, f"src/{folder} has no sources"
    return [(file, name) for file in files for name in INCLUDE.findall(file.read_text())]


@pytest.mark.parametrize("folder", MAY_INCLUDE)
def test_folder_includes_only_what_lies_below_it(folder: str) -> None:
    ours = set(MAY_INCLUDE) | {"runtime"}
    offenders = [
        f"{file.relative_to(CHECKOUT)} includes {name}"
        for file, name in includes_of(folder)
        if "/" in name and (first := name.split("/")[0]) in ours and first not in MAY_INCLUDE[folder]
    ]
    assert not offenders, "\n".join(offenders)


@pytest.mark.parametrize("folder", ["common", *sorted(CORES)])
def test_core_knows_no_message_bus(folder: str) -> None:
    offenders = [str(file) for file, name in includes_of(folder) if name.startswith(("lcm/", "ignis/"))]
    assert not offenders, "\n".join(offenders)


def test_gtsam_stays_in_the_sources_of_the_back_end() -> None:
    for folder in MAY_INCLUDE:
        for file, name in includes_of(folder):
            if name.startswith("gtsam/"):
                assert folder == "backend", f"{file} includes {name}"


def test_web_server_stays_in_map_builder() -> None:
    files = [f for top in ("src", "apps") for f in (CHECKOUT / top).rglob("*") if f.suffix in {".h", ".cpp"}]
    for file in files:
        if "boost/beast" in file.read_text():
            assert "map_builder" in file.parts, file
