# SPDX-License-Identifier: Apache-2.0
"""summary.html of a replay: one file that tells what happened."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis import trajectory_error
from ignis.errors import InputError
from ignis.files import write_text
from ignis.pages import charts, html
from ignis.pictures import write_pictures
from ignis.poses import Trajectory
from ignis.run_folder import Run

PAGE_NAME = "summary.html"
_APPLIED = "applied"
_MOST_LOOPS = 200


def write_run_page(run: Run) -> Path:
    """Writes the page, and the pictures of the map beside it."""
    page = run.folder / PAGE_NAME
    report = run.report
    lead = (
        f"{report['log']}, {report['duration_s']:.1f} s, {run.smoothed.path_length():.1f} m; "
        f"version {report['version']}, configuration {report['config_hash']}"
    )
    body = [
        _tiles(run),
        _remarks(run),
        _trajectories(run),
        _errors(run),
        _scans(run),
        _loops(run),
        _timing(run),
        html.section(
            "Biases of the filter, with 3 sigma", charts.biases(_seconds(run, run.states["utime"]), run.states)
        ),
        _map(run),
        _input(run),
        html.section(
            "Configuration and report",
            html.folded("config.json", json.dumps(run.config, indent=2)),
            html.folded("report.json", json.dumps(report, indent=2)),
        ),
    ]
    write_text(page, html.document(f"Replay {run.name}", lead, body))
    return page


def _seconds(run: Run, utime: NDArray[np.int64]) -> NDArray[np.float64]:
    """Since the log's first measurement."""
    return (utime - run.report["input"]["first_utime"]) * 1e-6


def _tiles(run: Run) -> str:
    report = run.report
    share = 100.0 * report["scans_applied"] / max(report["scans"], 1)
    values = [
        ("scans applied", f"{report['scans_applied']} of {report['scans']} ({share:.1f} %)"),
        ("keyframes", str(report["keyframes"])),
        ("loops kept", f"{report['loops_kept']}, withdrawn {report['loops_withdrawn']}"),
        ("times real time, all stages", f"{report['timing']['real_time_factor']:.1f}"),
        ("a scan, median / 99 %", f"{report['timing']['scan_p50_ms']:.2f} / {report['timing']['scan_p99_ms']:.2f} ms"),
    ]
    if run.truth is not None:
        for label, figures in _figures(run).items():
            values.append((f"ATE of {label}, rms", f"{figures['ate_rmse_m']:.3f} m"))
    return html.tiles(values)


def _figures(run: Run) -> dict[str, dict[str, Any]]:
    assert run.truth is not None
    try:
        return {
            label: trajectory_error.errors_of(trajectory_error.paired(estimate, run.truth), per_scan=False)
            for label, estimate in ((charts.ESKF, run.eskf), (charts.SMOOTHED, run.smoothed))
        }
    except InputError:
        return {}


def _remarks(run: Run) -> str:
    notes = [
        html.note(f"Start: {run.report['start']}"),
        html.note(
            f"Fingerprint of both trajectories {run.report['trajectory_hash']}, of the map {run.report['map_hash']}."
        ),
    ]
    notes += _refusal_remarks(run.report)
    live, drop = run.report["live"], run.report["input"]["first_drop"]
    if drop:
        notes.append(html.note(f"First recorded drop at {drop['s']:.3f} s: {drop['what']}.", "warn"))
    if live["recorded_scans"]:
        text = f"{live['equal_scans']} of {live['recorded_scans']} scans of the live run are equal bit for bit"
        if live["first_unequal_s"] is None:
            notes.append(html.note(text + ".", "good"))
        else:
            notes.append(
                html.note(
                    f"{text}; the first that differs ends at {live['first_unequal_s']:.3f} s, positions differ by at "
                    f"most {live['largest_distance_m']:.6f} m.",
                    "warn",
                )
            )
    notes += _graph_remarks(live["graph"])
    if run.report["loops_kept"] == 0:
        notes.append(html.note("No loop was kept: without one, smoothing changes positions but little."))
    return html.section("In words", *notes)


def _refusal_remarks(report: dict[str, Any]) -> list[str]:
    """What front end, graph and map did not take, and why."""

    def listed(counts: dict[str, int]) -> str:
        return ", ".join(f"{count} {reason}" for reason, count in counts.items())

    notes = []
    if report["imu_rejected"]:
        notes.append(html.note(f"IMU samples that the front end refused: {listed(report['imu_rejected'])}.", "warn"))
    if left_out := {reason: count for reason, count in report["scans_by_reason"].items() if reason != _APPLIED}:
        notes.append(html.note(f"Scans that the front end did not apply: {listed(left_out)}."))
    if report["refusals"]:
        notes.append(html.note(f"Refused: {report['refusals']}.", "warn"))
    else:
        notes.append(html.note("Graph and map refused nothing.", "good"))
    if report["solver_failure"]:
        notes.append(html.note(f"The graph ends before the drive does: {report['solver_failure']}.", "warn"))
    return notes


def _graph_remarks(graph: dict[str, Any]) -> list[str]:
    """Whether the replay's back end published what the live one had."""
    names = {
        "keyframes": "keyframe messages",
        "revisions": "messages of corrected poses",
        "loop_results": "loop results",
        "smoothed_states": "smoothed states",
    }
    notes = []
    for key, name in names.items():
        channel = graph[key]
        if channel["recorded"] == 0:
            continue
        text = f"{channel['equal']} of {channel['recorded']} {name} of the live run are equal bit for bit"
        if channel["first_unequal_s"] is None:
            notes.append(html.note(text + ".", "good"))
        else:
            notes.append(html.note(f"{text}; the first that differs is of {channel['first_unequal_s']:.3f} s.", "warn"))
    if graph["first_command_s"] is not None:
        notes.append(
            html.note(f"At {graph['first_command_s']:.3f} s somebody had a loop taken out of the live graph.", "warn")
        )
    return notes


def _drawn(run: Run) -> dict[str, Trajectory]:
    return {charts.ESKF: run.eskf, charts.SMOOTHED: run.smoothed}


def _trajectories(run: Run) -> str:
    loops = [(run.graph.position_of(a), run.graph.position_of(b)) for a, b in run.graph.loops]
    views = html.side_by_side(charts.from_above(_drawn(run), loops), charts.from_the_side(_drawn(run)))
    return html.section(
        "Trajectories, from above and from the side",
        views,
        '<p class="small">Each in its own frame, from the first pose on: ESKF only in odom, smoothed in map.</p>',
    )


def _errors(run: Run) -> str:
    if run.truth is None:
        return ""
    series = {}
    try:
        for label, estimate in _drawn(run).items():
            pair = trajectory_error.paired(estimate, run.truth)
            aligned, _ = trajectory_error.aligned_se3(pair)
            errors = trajectory_error.position_errors(aligned, pair.truth)
            series[label] = (_seconds(run, pair.truth.utime), errors)
    except InputError as error:
        return html.section("Error over time", html.note(str(error), "warn"))
    return html.section(
        "Error over time",
        charts.over_time(series, "distance from the ground truth after SE(3) alignment (no scale)", "error [m]"),
    )


def _scans(run: Run) -> str:
    reason = run.scans["reason"].astype(np.str_)
    applied = run.scans["applied"] == 1
    counts = Counter(reason.tolist())
    return html.section(
        "Scans, and why they were not applied",
        charts.reasons(_seconds(run, run.scans["utime"]), reason, applied),
        html.table(("reason", "scans"), [(name, str(count)) for name, count in counts.most_common()]),
    )


def _loops(run: Run) -> str:
    loops = run.loops
    candidates = [i for i in range(len(loops["utime"])) if loops["from_id"][i] >= 0]
    outcome = Counter(str(name) for name in loops["reason"].tolist())
    rows = [
        (
            f"{_seconds(run, loops['utime'][i : i + 1])[0]:.1f}",
            f"{loops['from_id'][i]} to {loops['to_id'][i]}",
            str(loops["stage"][i]),
            str(loops["reason"][i]),
            f"{loops['correction_m'][i]:.3f}",
            f"{np.degrees(loops['correction_rad'][i]):.2f}",
            f"{loops['mean_residual_m'][i]:.3f}",
            f"{100 * loops['matched_fraction'][i]:.0f}",
        )
        for i in candidates[:_MOST_LOOPS]
    ]
    head = ("time [s]", "keyframes", "stage", "outcome", "correction [m]", "[deg]", "residual [m]", "matched [%]")
    left_out = len(candidates) - len(rows)
    return html.section(
        "Loops",
        html.note("; ".join(f"{count} {name}" for name, count in outcome.most_common())) if outcome else "",
        html.table(head, rows) if rows else html.note("No keyframe had a candidate."),
        html.note(f"{left_out} more rows stand in loops.csv.") if left_out else "",
    )


def _timing(run: Run) -> str:
    timing = run.report["timing"]
    stages = [
        (
            name,
            f"{timing[name]['calls']}",
            f"{timing[name]['total_ms']:.0f}",
            f"{timing[name]['p50_ms']:.3f}",
            f"{timing[name]['p99_ms']:.3f}",
        )
        for name in ("frontend", "backend", "batch_optimum", "map")
    ]
    chart = ""
    if run.timing is not None and len(run.timing["utime"]):
        chart = charts.milliseconds(_seconds(run, run.timing["utime"]), run.timing["frontend_ms"].astype(float))
    head = ("stage", "calls", "total [ms]", "median [ms]", "99 % [ms]")
    return html.section("Timings", chart, html.table(head, stages))


def _map(run: Run) -> str:
    try:
        top, oblique, _ = write_pictures(run.folder)
    except InputError as error:
        return html.section("Map", html.note(str(error), "warn"))
    voxels = run.report["voxels"]
    caption = f"{voxels['local']} cells of 0.125 m, {voxels['mid']} of 0.25 m, {voxels['coarse']} of 0.5 m"
    return html.section(
        "Map",
        html.picture(top, f"From above; colour is height over the path. {caption}"),
        html.picture(oblique, "Obliquely"),
    )


def _input(run: Run) -> str:
    content = run.report["input"]
    rows = [(name, str(count), "replayed") for name, count in content["used"].items()]
    rows += [(name, str(count), "not replayed") for name, count in content["ignored"].items()]
    losses = [
        (title, str(content[key]))
        for key, title in (
            ("missing_imu", "IMU samples missing by their running number"),
            ("missing_scans", "scans missing by their running number"),
            ("incomplete_scans", "scans with a part missing"),
            ("out_of_order", "measurements recorded out of order"),
            ("undecodable", "messages of another type or damaged"),
            ("damaged_bytes", "bytes in no whole record"),
        )
    ]
    return html.section(
        "Input",
        html.side_by_side(html.table(("channel", "messages", ""), rows), html.table(("losses", "count"), losses)),
    )
