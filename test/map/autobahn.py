# SPDX-License-Identifier: Apache-2.0
"""The Autobahn test suite against an echo server with the options of our viewers' connections (row W3).

Not part of the test run: every release of the suite wants Python 2.7. Where there is one,

    virtualenv -p python2.7 py27 && py27/bin/pip install autobahntestsuite==0.8.2
    ./ignis shell python3 test/map/autobahn.py --wstest py27/bin/wstest

Exits with 1 when a case fails, passes only loosely, or a group has not run.
"""

import argparse
import collections
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from ignis.pipeline import binary

# 12 and 13 are about compression, which our server does not offer.
GROUPS = (1, 2, 3, 4, 5, 6, 7, 9, 10)
GOOD = {"OK", "INFORMATIONAL"}


def run_suite(wstest: Path, folder: Path) -> dict[str, dict[str, str]]:
    """Runs all cases; what the suite says of each."""
    echo = subprocess.Popen([binary("websocket_echo")], stdout=subprocess.PIPE, text=True)
    try:
        port = int(echo.stdout.readline()) if echo.stdout else 0
        specification = {
            "outdir": str(folder),
            "servers": [{"agent": "ignis", "url": f"ws://127.0.0.1:{port}"}],
            "cases": [f"{group}.*" for group in GROUPS],
            "exclude-cases": [],
        }
        (folder / "spec.json").write_text(json.dumps(specification))
        command = [wstest, "-m", "fuzzingclient", "-s", folder / "spec.json"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=1800)
    finally:
        echo.terminate()
        echo.wait()
    return json.loads((folder / "index.json").read_text())["ignis"]


def groups_without_a_case(cases: Iterable[str]) -> set[int]:
    """Which of the groups were not run: a suite that finds no server, or no case, ends without an error."""
    return set(GROUPS) - {int(name.partition(".")[0]) for name in cases}


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wstest", type=Path, required=True, help="the suite's executable")
    with tempfile.TemporaryDirectory() as folder:
        cases = run_suite(parser.parse_args().wstest.resolve(), Path(folder))
    counts = collections.Counter(case["behavior"] for case in cases.values())
    print(f"{len(cases)} cases: {', '.join(f'{count} {name}' for name, count in sorted(counts.items()))}")
    bad = {name for name, case in cases.items() if not {case["behavior"], case["behaviorClose"]} <= GOOD}
    if bad:
        print(f"not as they should: {', '.join(sorted(bad))}")
    if missing := groups_without_a_case(cases):
        print(f"no case of the groups {', '.join(map(str, sorted(missing)))} has run")
    return 1 if bad or missing else 0


if __name__ == "__main__":
    sys.exit(main())
