# SPDX-License-Identifier: Apache-2.0
"""What smoothing gained, with a confidence interval over the drives, and the same in words.

The interval is a bootstrap over drives (BCa: B. Efron, Better bootstrap confidence intervals, JASA 82, 1987): scans of
one drive share their errors, so only drives count as draws.
"""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

METRICS = {
    "ate_rmse_m": "ATE",
    "ate_yaw_rmse_m": "ATE with yaw and position aligned",
    "rpe_10m_rmse_m": "RPE per 10 m",
    "end_error_m": "end-point error",
    "tilt_rmse_deg": "tilt error",
}
LEVEL = 0.95
_FEWEST = 3
_RESAMPLES = 9999
# A change of less than this share of the error serves nobody, however sure it is.
_NOTEWORTHY = 0.02


def gain_of(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Per metric: mean of (ESKF only - smoothed) over the drives with ground truth, its interval, and sentences."""
    judged = [run for run in runs if run["ground_truth"]]
    gains: dict[str, Any] = {}
    for key in METRICS:
        both = [(r["trajectories"]["eskf"].get(key), r["trajectories"]["smoothed"].get(key)) for r in judged]
        pairs = np.array([pair for pair in both if None not in pair], dtype=float).reshape(-1, 2)
        if len(pairs):
            gains[key] = _gain(pairs)
    return {"drives": len(judged), "level": LEVEL, "gains": gains, "words": words(judged, gains)}


def _gain(pairs: NDArray[np.float64]) -> dict[str, Any]:
    difference = pairs[:, 0] - pairs[:, 1]
    return {
        "eskf_mean": float(pairs[:, 0].mean()),
        "smoothed_mean": float(pairs[:, 1].mean()),
        "gain_mean": float(difference.mean()),
        "interval": interval(difference),
        "better_in": int(np.sum(difference > 0.0)),
        "drives": len(pairs),
    }


def interval(values: NDArray[np.float64]) -> list[float] | None:
    """Of the mean; None for fewer than three values, which no resampling makes more of."""
    if len(values) < _FEWEST:
        return None
    if np.ptp(values) == 0.0:
        return [float(values[0])] * 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # BCa has no answer for some tiny samples; percentiles then do.
        for method in ("BCa", "percentile"):
            result = bootstrap(
                (values,), np.mean, n_resamples=_RESAMPLES, confidence_level=LEVEL, method=method, rng=1
            ).confidence_interval
            if np.isfinite([result.low, result.high]).all():
                return [float(result.low), float(result.high)]
    return None


def words(judged: list[dict[str, Any]], gains: dict[str, Any]) -> list[str]:
    """Whether smoothing helped, sentence by sentence."""
    if not judged:
        return ["Without ground truth nobody can say whether smoothing helped."]
    sentences = [_sentence(METRICS[key], gain, "deg" if key.endswith("deg") else "m") for key, gain in gains.items()]
    loops = [run["loops_kept"] for run in judged if run["loops_kept"] is not None]
    if loops and not any(loops):
        where = "this drive" if len(loops) == 1 else "any of these drives"
        sentences.append(f"No loop was kept in {where}: without loops, smoothing changes positions but little.")
    if len(judged) < _FEWEST:
        sentences.append(
            f"{len(judged)} drive{'s are' if len(judged) > 1 else ' is'} too few for a confidence interval; "
            f"give at least {_FEWEST} runs with other seeds or recordings."
        )
    return sentences


def _sentence(title: str, gain: dict[str, Any], unit: str) -> str:
    change = (
        f"{title}: {gain['eskf_mean']:.3f} {unit} with ESKF only, {gain['smoothed_mean']:.3f} {unit} smoothed, "
        f"gain {gain['gain_mean']:+.4f} {unit}"
    )
    share = gain["gain_mean"] / gain["eskf_mean"] if gain["eskf_mean"] > 0.0 else 0.0
    if gain["interval"] is None:
        if abs(share) < _NOTEWORTHY:
            return f"Smoothing made no difference to {change}."
        return f"Smoothing {'helped' if share > 0.0 else 'did not help, it cost accuracy'}. {change} ({share:+.0%})."
    low, high = gain["interval"]
    band = f"{LEVEL:.0%} interval {low:+.4f} to {high:+.4f} over {gain['drives']} drives"
    if low > 0.0 or high < 0.0:
        if abs(share) < _NOTEWORTHY:
            return f"Smoothing made hardly a difference to {change} ({share:+.1%}; {band})."
        if low > 0.0:
            return f"Smoothing helped. {change} ({share:+.0%}; {band}; better in {gain['better_in']})."
        return f"Smoothing did not help, it cost accuracy. {change} ({share:+.0%}; {band})."
    return f"Smoothing did not clearly help. {change} ({band}, which contains 0)."
