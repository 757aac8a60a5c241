# SPDX-License-Identifier: Apache-2.0
"""The order of the files: what installs packages runs while the network of the machine is still there."""

import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]


def test_files_that_enter_a_private_network_come_last() -> None:
    collected = subprocess.run(
        [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", TESTS],
        capture_output=True,
        text=True,
        cwd=TESTS.parent,
        timeout=120,
    )
    assert collected.returncode == 0, collected.stdout + collected.stderr
    files = list(dict.fromkeys(line.split("::")[0] for line in collected.stdout.splitlines() if "::" in line))
    # The first installs the Ouster SDK on a new machine; the second would come before it by name.
    assert files.index("test/python/test_importing_ouster.py") < files.index("test/faults/burst_test.py")
