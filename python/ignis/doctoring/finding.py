# SPDX-License-Identifier: Apache-2.0
"""A finding: what was looked at, how it is, and the command that mends it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Any


class Severity(IntEnum):
    """How much a finding matters."""

    OK = 0
    NOTE = 1
    WARNING = 2
    ERROR = 3


# In the order in which to mend: what comes later cannot be judged before what comes earlier is right. The number is the
# exit code when this is the first part with an error.
EXIT_CODES = {"software": 10, "host": 11, "bus": 12, "sensor": 13, "mount": 14, "data": 15}
EXIT_WARNINGS = 9


@dataclass(frozen=True)
class Finding:
    """One line of the report."""

    part: str
    check: str
    severity: Severity
    text: str
    fix: str = ""

    def as_json(self) -> dict[str, Any]:
        """For `--json`."""
        return {**asdict(self), "severity": self.severity.name}


def exit_code(findings: Iterable[Finding]) -> int:
    """0: nothing to do; 9: warnings only; else the code of the first part, in the order of mending, with an error."""
    found = list(findings)
    for part, code in EXIT_CODES.items():
        if any(f.part == part and f.severity == Severity.ERROR for f in found):
            return code
    return EXIT_WARNINGS if any(f.severity == Severity.WARNING for f in found) else 0
