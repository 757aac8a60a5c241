# SPDX-License-Identifier: Apache-2.0
"""The table of a sweep as Parquet and CSV, and the page."""

from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.csv
import pyarrow.parquet

from ignis.files import replacing, write_text
from ignis.pages import charts, html
from ignis.sweeping.grid import Task
from ignis.sweeping.task import FIGURE_COLUMNS, TIMING_COLUMNS, Row

_ARROW = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64()}
_SHOWN = (
    ("eskf_ate_rmse_m", "ATE, ESKF m", 3),
    ("smoothed_ate_rmse_m", "ATE, smoothed m", 3),
    ("smoothed_ate_yaw_rmse_m", "yaw ATE, smoothed m", 3),
    ("smoothed_rpe_10m_rmse_m", "RPE/10 m, smoothed", 3),
    ("nees_position", "NEES pos.", 2),
    ("scans_applied", "applied", 0),
    ("loops_kept", "loops", 0),
)
_JUDGED = "smoothed_ate_rmse_m"


def write_outcome(folder: Path, tasks: list[Task], rows: dict[str, Row], keys: list[str]) -> pyarrow.Table:
    """table.parquet, table.csv (equal for equal results, wherever they were computed), timing.csv and sweep.html. Tasks
    without a row yet are left out; the order is that of the grid."""
    done = [(task, rows[task.folder]) for task in tasks if task.folder in rows]
    table = _table(done, keys, FIGURE_COLUMNS)
    with replacing(folder / "table.parquet") as temporary:
        pyarrow.parquet.write_table(table, temporary)
    with replacing(folder / "table.csv") as temporary:
        pyarrow.csv.write_csv(table, temporary)
    with replacing(folder / "timing.csv") as temporary:
        pyarrow.csv.write_csv(_table(done, keys, TIMING_COLUMNS), temporary)
    write_text(folder / "sweep.html", _page(done, keys, len(tasks)))
    return table


def _table(done: list[tuple[Task, Row]], keys: list[str], kinds: dict[str, type]) -> pyarrow.Table:
    columns: dict[str, Any] = {"log": pyarrow.array([Path(task.log).name for task, _ in done], pyarrow.string())}
    for key in keys:
        columns[key] = pyarrow.array([dict(task.changes)[key] for task, _ in done], pyarrow.string())
    for name, kind in kinds.items():
        columns[name] = pyarrow.array([row.get(name) for _, row in done], _ARROW[kind])
    return pyarrow.table(columns)


def _page(done: list[tuple[Task, Row]], keys: list[str], total: int) -> str:
    failed = sum(row["status"] != "ok" for _, row in done)
    lead = f"{len(done)} of {total} replays, {failed} failed; {len({task.log for task, _ in done})} logs"
    head = ("log", *keys, *(title for _, title, _ in _SHOWN))
    body = [
        tuple([Path(task.log).stem, *(value for _, value in task.changes), *(_cell(row, k, d) for k, _, d in _SHOWN)])
        for task, row in done
    ]
    judged = [(task, row) for task, row in done if row.get(_JUDGED) is not None]
    pieces = [charts.bars(_means(judged, key), f"mean ATE by {key}", "m") for key in keys if judged]
    if len(keys) == 2 and judged:
        pieces.append(_grid(judged, keys))
    sections = [html.section("By parameter", html.side_by_side(*pieces))] if pieces else []
    if failed:
        reasons = [f"{task.title}: {row['failure']}" for task, row in done if row["status"] != "ok"]
        sections.append(html.section("Failed", *(html.note(reason, "warn") for reason in reasons)))
    return html.document("Sweep", lead, [*sections, html.section("All replays", html.table(head, body))])


def _means(judged: list[tuple[Task, Row]], key: str) -> dict[str, dict[str, float]]:
    groups: dict[str, dict[str, float]] = {}
    for value in dict.fromkeys(dict(task.changes)[key] for task, _ in judged):
        chosen = [row for task, row in judged if dict(task.changes)[key] == value]
        groups[value] = {
            label: sum(row[f"{name}_ate_rmse_m"] for row in chosen) / len(chosen)
            for name, label in (("eskf", charts.ESKF), ("smoothed", charts.SMOOTHED))
        }
    return groups


def _grid(judged: list[tuple[Task, Row]], keys: list[str]) -> str:
    values = [list(dict.fromkeys(dict(task.changes)[key] for task, _ in judged)) for key in keys]
    cells = [[_mean_at(judged, keys, (a, b)) for b in values[1]] for a in values[0]]
    return charts.heat(cells, values[0], values[1], (keys[0], keys[1]), "mean ATE of smoothed over the logs [m]")


def _mean_at(judged: list[tuple[Task, Row]], keys: list[str], at: tuple[str, str]) -> float:
    chosen = [row[_JUDGED] for task, row in judged if tuple(dict(task.changes)[key] for key in keys) == at]
    return sum(chosen) / len(chosen) if chosen else float("nan")


def _cell(row: Row, key: str, digits: int) -> str:
    value = row.get(key)
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.{digits}f}"
