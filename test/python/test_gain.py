# SPDX-License-Identifier: Apache-2.0
"""The gain of smoothing: an interval that covers what it promises, and words that follow from it."""

from typing import Any

import numpy as np
import pytest

from ignis.comparing.gain import LEVEL, gain_of, interval


def runs(eskf: list[float], smoothed: list[float], loops: int | None = 2) -> list[dict[str, Any]]:
    return [
        {
            "ground_truth": True,
            "loops_kept": loops,
            "trajectories": {"eskf": {"ate_rmse_m": a}, "smoothed": {"ate_rmse_m": b}},
        }
        for a, b in zip(eskf, smoothed, strict=True)
    ]


def test_the_interval_covers_the_true_mean_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(60):
        low, high = interval(rng.normal(0.3, 1.0, 30)) or [0.0, 0.0]
        covered += low <= 0.3 <= high
    assert covered / 60 == pytest.approx(LEVEL, abs=0.08)


def test_equal_values_give_a_point_and_two_values_give_nothing() -> None:
    assert interval(np.array([0.5, 0.5, 0.5])) == [0.5, 0.5]
    assert interval(np.array([0.1, 0.9])) is None


def test_a_clear_gain_is_called_help() -> None:
    result = gain_of(runs([0.30, 0.35, 0.28, 0.33, 0.31], [0.10, 0.12, 0.11, 0.10, 0.13]))
    gain = result["gains"]["ate_rmse_m"]
    assert gain["gain_mean"] == pytest.approx(0.202) and gain["better_in"] == 5
    assert gain["interval"][0] > 0.1
    assert result["words"][0].startswith("Smoothing helped. ATE")


def test_a_clear_loss_is_said_plainly() -> None:
    result = gain_of(runs([0.10, 0.12, 0.11, 0.10], [0.20, 0.22, 0.21, 0.25]))
    assert result["words"][0].startswith("Smoothing did not help, it cost accuracy.")


def test_an_interval_with_zero_is_no_clear_help() -> None:
    result = gain_of(runs([0.10, 0.20, 0.10, 0.20, 0.15], [0.14, 0.15, 0.12, 0.18, 0.16]))
    assert result["words"][0].startswith("Smoothing did not clearly help.")
    assert "which contains 0" in result["words"][0]


def test_one_drive_has_words_but_no_interval() -> None:
    result = gain_of(runs([0.2], [0.1]))
    assert result["gains"]["ate_rmse_m"]["interval"] is None
    assert "+50%" in result["words"][0] and "too few for a confidence interval" in result["words"][-1]
    assert gain_of(runs([0.2], [0.1999]))["words"][0].startswith("Smoothing made no difference")
    sure = gain_of(runs([0.2, 0.21, 0.22, 0.23], [0.1998, 0.2097, 0.2198, 0.2297]))
    assert sure["gains"]["ate_rmse_m"]["interval"][0] > 0.0
    assert sure["words"][0].startswith("Smoothing made hardly a difference to ATE") and "(+0.1%;" in sure["words"][0]


def test_missing_loops_and_missing_truth_are_told() -> None:
    assert any("No loop was kept" in word for word in gain_of(runs([0.2] * 3, [0.2] * 3, loops=0))["words"])
    assert not any("No loop" in word for word in gain_of(runs([0.2] * 3, [0.2] * 3, loops=None))["words"])
    (blind,) = runs([0.2], [0.1])
    blind["ground_truth"] = False
    assert gain_of([blind])["words"] == ["Without ground truth nobody can say whether smoothing helped."]
