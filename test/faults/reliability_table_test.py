# SPDX-License-Identifier: Apache-2.0
"""docs/reliability.md and its pages: every row of the fault list, tests that exist, and a test for every reason."""

import os
import re
from functools import cache
from pathlib import Path

import pytest

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
OVERVIEW = CHECKOUT / "docs" / "reliability.md"
PAGES = CHECKOUT / "docs" / "reliability"
ROW = re.compile(r"^\| \[([A-Z]\d+)\]\(([^)]+)\) \|[^|]*\| (holds|in part|open) \|", re.MULTILINE)
SECTION = re.compile(r"^## ([A-Z]\d+): .*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
ROWS = {"D": 6, "F": 11, "B": 7, "T": 2, "G": 5, "M": 4, "W": 8, "L": 4, "C": 4, "P": 9}
CPP_TEST = re.compile(r"^(?:TEST|TEST_F|TEST_P|TYPED_TEST)\((\w+),\s*(\w+)", re.MULTILINE)
PYTHON_TEST = re.compile(r"^\s*def (test_\w+)", re.MULTILINE)
# Where reasons are defined.
ENUMS = {
    "ScanReason": "src/frontend/scan_stats.h",
    "LoopReason": "src/backend/loops/loop_result.h",
    "KeyframeVerdict": "src/backend/smoother.h",
    "ImuFault": "src/frontend/filter/imu_buffer.h",
}


@cache
def cpp_sources() -> dict[Path, str]:
    return {path: path.read_text() for path in (CHECKOUT / "test").rglob("*_test.cpp")}


def existing_tests() -> set[str]:
    """Every test as the table names it: Suite.Name, or file.py::test_name."""
    found = {f"{suite}.{name}" for text in cpp_sources().values() for suite, name in CPP_TEST.findall(text)}
    for path in (CHECKOUT / "test").rglob("*_test.py"):
        found |= {f"{path.name}::{name}" for name in PYTHON_TEST.findall(path.read_text())}
    for path in (CHECKOUT / "test").rglob("test_*.py"):
        found |= {f"{path.name}::{name}" for name in PYTHON_TEST.findall(path.read_text())}
    found |= {f"fuzz_{path.name.removesuffix('_fuzz.cpp')}" for path in (CHECKOUT / "fuzz").glob("*_fuzz.cpp")}
    return found


def sections() -> dict[str, str]:
    """What the pages say of each row, by its number."""
    return {match[1]: match[0] for page in PAGES.glob("*.md") for match in SECTION.finditer(page.read_text())}


def test_every_row_of_the_fault_list_stands_in_the_table_and_has_a_section() -> None:
    expected = {f"{letter}{number}" for letter, count in ROWS.items() for number in range(1, count + 1)}
    assert {number for number, _, _ in ROW.findall(OVERVIEW.read_text())} == expected
    assert set(sections()) == expected


def test_the_table_says_what_the_sections_say() -> None:
    for number, link, result in ROW.findall(OVERVIEW.read_text()):
        assert f"**{result.capitalize()}.**" in sections()[number], number
        page = OVERVIEW.parent / link.split("#")[0]
        assert f"## {number}: " in page.read_text(), (number, link)


def test_every_test_that_a_section_names_exists() -> None:
    existing = existing_tests()
    for number, text in sections().items():
        named = re.findall(r"^- `([^`]+)`$", text, re.MULTILINE)
        assert named, f"{number}: no test"
        missing = [name for name in named if name not in existing]
        assert not missing, (number, missing)


@pytest.mark.parametrize("enum", ENUMS)
def test_every_reason_is_emitted_by_some_test(enum: str) -> None:
    body = re.search(rf"enum class {enum}\b.*?\{{(.*?)\}};", (CHECKOUT / ENUMS[enum]).read_text(), re.DOTALL)
    assert body
    names = set(re.findall(r"\bk[A-Z]\w+", re.sub(r"//.*", "", body[1])))
    assert len(names) > 3
    # Lists of names beside the message's constants emit nothing.
    lines = [line for text in cpp_sources().values() for line in text.splitlines() if '{"' not in line]
    tested = {name for name in names if any(re.search(rf"{enum}::{name}\b", line) for line in lines)}
    assert tested == names
