# SPDX-License-Identifier: Apache-2.0
"""The web client's own checks: types, unit tests, and that its lock file names no registry."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

WEB = Path(os.environ["IGNIS_CHECKOUT"]) / "apps" / "map_builder" / "web"


def test_types_hold() -> None:
    run("tsc", "--noEmit")


def test_unit_tests_pass() -> None:
    assert re.search(r"Tests\s+\d+ passed", run("vitest", "run", "--reporter=default"))


def test_lock_holds_exact_versions_and_no_address() -> None:
    lock = json.loads((WEB / "package-lock.json").read_text())
    for name, package in lock["packages"].items():
        assert "resolved" not in package, name
        assert name == "" or package["integrity"].startswith("sha512-"), name
    wanted = json.loads((WEB / "package.json").read_text())
    for name, version in {**wanted["dependencies"], **wanted["devDependencies"]}.items():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version), name


@pytest.mark.parametrize("name", ["@rolldown/binding-linux-arm64-gnu", "@rolldown/binding-linux-x64-gnu"])
def test_lock_serves_both_platforms(name: str) -> None:
    assert f"node_modules/{name}" in json.loads((WEB / "package-lock.json").read_text())["packages"]


def run(*command: str) -> str:
    environment = {**os.environ, "NO_COLOR": "1"}
    done = subprocess.run(
        ["npm", "exec", "--offline", "--", *command], cwd=WEB, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
