# SPDX-License-Identifier: Apache-2.0
"""Rows C1 to C3: every key misspelt and given every kind of wrong value, named in one message each."""

import json
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., subprocess.CompletedProcess]
PROCESSES = ("l1_driver", "lio_frontend", "graph_backend", "map_builder")


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    """The schema of the configuration, which lists every key with its type and range."""
    from ignis.pipeline import binary

    printed = subprocess.run([binary("lio_frontend"), "--print-schema"], check=True, capture_output=True, text=True)
    return json.loads(printed.stdout)


def leaves(schema: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """Every key that holds a value, with its part of the schema."""
    for name, entry in schema.get("properties", {}).items():
        if name == "$schema":
            continue
        if "properties" in entry:
            yield from leaves(entry, (*path, name))
        else:
            yield (*path, name), entry


def refused(config: dict[str, Any], tmp_path: Path, run_binary: Run, process: str = "lio_frontend") -> str:
    """The one message of a process that refuses; nothing else may have happened."""
    file = tmp_path / "wrong.json"
    file.write_text(json.dumps(config))
    began = time.monotonic()
    done = run_binary(process, "--config", file)
    assert done.returncode == 2, done.stderr[-500:]
    assert time.monotonic() - began < 5.0, "1 s is promised; the machine may be busy"
    assert done.stdout == "" and "terminate" not in done.stderr
    return done.stderr


def config_of(changes: dict[tuple[str, ...], Any]) -> dict[str, Any]:
    """A configuration that holds these values."""
    config: dict[str, Any] = {}
    for path, value in changes.items():
        section = config
        for name in path[:-1]:
            section = section.setdefault(name, {})
        section[path[-1]] = value
    return config


def test_fault_c2_every_key_misspelt_is_named_with_the_nearest_valid_one(
    schema: dict[str, Any], run_binary: Run, tmp_path: Path
) -> None:
    keys = [path for path, _ in leaves(schema)]
    assert len(keys) > 100
    message = refused(config_of({(*path[:-1], path[-1] + "x"): 1 for path in keys}), tmp_path, run_binary)
    for path in keys:
        assert f'did you mean "{path[-1]}"' in message, path


def out_of_range(entry: dict[str, Any]) -> list[Any]:
    """Values one step outside of what the schema allows."""
    step = 1 if entry.get("type") == "integer" else 1e-3
    values = [
        bound + sign * max(step, abs(bound) * 1e-6)
        for bound, sign in ((entry[key], sign) for key, sign in (("minimum", -1), ("maximum", 1)) if key in entry)
    ]
    return [round(value) if entry.get("type") == "integer" else value for value in values]


@pytest.mark.parametrize("wrong", [True, "text", None, [], {}, 1e308, -1e308, 1.9, 300_000_000_000])
def test_fault_c3_every_key_refuses_a_wrong_value_by_name(
    wrong: Any, schema: dict[str, Any], run_binary: Run, tmp_path: Path
) -> None:
    def is_wrong_for(entry: dict[str, Any]) -> bool:
        kind = entry.get("type")
        if kind == "boolean":
            return wrong is not True
        if kind == "string":
            return not isinstance(wrong, str) or "enum" in entry
        if kind == "array":
            return not isinstance(wrong, list) or "minItems" in entry
        if kind in ("number", "integer"):
            is_number = isinstance(wrong, int | float) and not isinstance(wrong, bool)
            whole = kind == "number" or (is_number and float(wrong).is_integer())
            inside = is_number and entry.get("minimum", -1e308) <= wrong <= entry.get("maximum", 1e308)
            return not (is_number and whole and inside)
        return False

    keys = [path for path, entry in leaves(schema) if is_wrong_for(entry)]
    assert keys
    message = refused(config_of({path: wrong for path in keys}), tmp_path, run_binary)
    missing = [".".join(path) for path in keys if ".".join(path) not in message]
    assert not missing, (missing, message[:500])


def test_fault_c3_every_number_one_step_outside_its_range_is_refused(
    schema: dict[str, Any], run_binary: Run, tmp_path: Path
) -> None:
    for side in (0, -1):
        changes = {path: values[side] for path, entry in leaves(schema) if (values := out_of_range(entry))}
        assert len(changes) > 80
        message = refused(config_of(changes), tmp_path, run_binary)
        missing = [".".join(path) for path in changes if ".".join(path) not in message]
        assert not missing, missing


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "not valid JSON"),
        (b'{"frontend": {"iterations": 3,}}', "line 1, column"),
        (b'{"map": {"local_cell_m": 1},\n "map": {}}', 'line 2, column 6: the key "map" stands twice'),
        (b'{"frontend": {"voxel_size_m": NaN}}', "not valid JSON"),
        (b"\xff\xfe{}", "not valid JSON"),
        (b"[" * 100_000, "line 1, column 18: nesting deeper than 16"),
    ],
)
def test_fault_c1_a_broken_file_is_refused_with_place_and_reason(
    content: bytes, expected: str, process: str, run_binary: Run, tmp_path: Path
) -> None:
    file = tmp_path / "broken.json"
    file.write_bytes(content)
    done = run_binary(process, "--config", file)
    assert done.returncode == 2 and done.stdout == ""
    assert "broken.json" in done.stderr and expected in done.stderr and len(done.stderr) < 1000


@pytest.mark.parametrize("process", PROCESSES)
def test_fault_c1_a_folder_and_a_missing_file_are_named(process: str, run_binary: Run, tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.json"):
        done = run_binary(process, "--config", path)
        assert done.returncode == 2 and str(path) in done.stderr
