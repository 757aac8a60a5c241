# SPDX-License-Identifier: Apache-2.0
"""What the recorder does with a disk that fails by turns, and with what its logger says."""

import os

from ignis.growing_pause import GrowingPause
from ignis.last_words import LastWords


def test_pauses_grow_with_each_failure_and_are_short_again_after_a_minute_of_success() -> None:
    pause = GrowingPause()
    seen = []
    for lived in (5.0, 1.0, 3.0, 59.0, 60.0, 2.0):
        pause.failed_after(lived)
        seen.append(pause.seconds)
    assert seen == [2.0, 5.0, 10.0, 10.0, 2.0, 5.0]


def test_of_what_is_said_without_end_the_end_is_kept() -> None:
    near, far = os.pipe()
    with open(near) as stream:
        words = LastWords(stream)
        assert words.take() == ""
        for _ in range(100):
            os.write(far, b"x" * 1000)
            words.take()
        os.write(far, b"the end")
        os.close(far)
        assert words.take().endswith("xthe end") and len(words.text) < 10_000
