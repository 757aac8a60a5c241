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
# Inside the cores. What is not named here may include any part of its core: the orchestrators on top, and keyframes,
# loops, journal and shadow of the back end, which work on one graph. A file name is the core's shared vocabulary.
PARTS_MAY_INCLUDE = {
    "frontend": {
        "filter": {"frontend_config.h"},
        "planes": {"frontend_config.h"},
        "local_map": {"frontend_config.h", "planes"},
        "matching": {"frontend_config.h", "scan_stats.h", "filter", "planes", "local_map"},
        "start": {"frontend_config.h", "filter", "planes", "local_map", "matching"},
        "recovery": {"frontend_config.h", "filter", "planes", "local_map", "matching"},
        "keyframes": {"frontend_config.h", "filter", "local_map", "matching"},
        "trust": {"frontend_config.h", "scan_stats.h", "filter"},
    },
    "backend": {
        "solver": set(),
        "factors": {"backend_config.h", "solver"},
        "pose_graph": {"keyframe_pose.h", "solver", "factors"},
    },
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


@pytest.mark.parametrize(
    ("core", "part"), [(core, part) for core in PARTS_MAY_INCLUDE for part in PARTS_MAY_INCLUDE[core]]
)
def test_part_of_a_core_includes_only_parts_below_it(core: str, part: str) -> None:
    allowed = PARTS_MAY_INCLUDE[core][part] | {part}
    offenders = [
        f"{file.relative_to(CHECKOUT)} includes {name}"
        for file, name in includes_of(f"{core}/{part}")
        if name.startswith(f"{core}/") and name.split("/")[1] not in allowed
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
