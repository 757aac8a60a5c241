# SPDX-License-Identifier: Apache-2.0
"""How long to wait before the next try of something that fails again and again."""

_PAUSES_S = (2.0, 5.0, 10.0)
_GOOD_S = 60.0  # after so long of success it is another failure


class GrowingPause:
    """Pauses of 2, 5 and 10 s; a failure after a minute of success is the first one again."""

    def __init__(self) -> None:
        self._failures = 0

    @property
    def seconds(self) -> float:
        """From the begin of the try that failed to the next one."""
        return _PAUSES_S[min(max(self._failures, 1), len(_PAUSES_S)) - 1]

    def failed_after(self, seconds: float) -> None:
        """The newest try has failed after so long of success."""
        self._failures = 1 if seconds >= _GOOD_S else self._failures + 1
