# SPDX-License-Identifier: Apache-2.0
"""An archive for a bug report: what is inside, and that its log is the end of the given one."""

import json
import tarfile
from pathlib import Path

import pytest

from ignis import read_log
from ignis.bundle import main
from recorded_run import CONFIG, START_US, write_live_log


def extracted(archive: Path, folder: Path) -> Path:
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    (inside,) = folder.iterdir()
    return inside


def test_a_log_gives_its_end_its_configuration_and_counters(tmp_path: Path) -> None:
    log = write_live_log(tmp_path / "drive.lcmlog")
    assert main([str(log), "-o", str(tmp_path / "b.tar.gz"), "--seconds", "0.2"]) == 0
    inside = extracted(tmp_path / "b.tar.gz", tmp_path / "x")
    end = read_log(inside / "last_0_s.lcmlog")
    assert end["L1_IMU"].utime[0] == START_US + 300_000 and end["L1_IMU"].utime[-1] == START_US + 490_000
    assert json.loads((inside / "config_in_log.json").read_text()) == CONFIG
    counters = json.loads((inside / "counters.json").read_text())
    assert counters["messages"]["L1_IMU"] == 50
    assert counters["newest"]["HEALTH lio_frontend"]["state_text"] == "one direction is not observed"
    assert set(json.loads((inside / "versions.json").read_text())) >= {"ignis", "commit", "system", "packages"}
    listed = (inside / "README.txt").read_text()
    assert all(path.name in listed for path in inside.iterdir() if path.name != "README.txt")


def test_a_run_gives_its_tables_and_the_log_that_it_names(tmp_path: Path, capsys) -> None:
    log = write_live_log(tmp_path / "drive.lcmlog")
    run = tmp_path / "run"
    (run / "logs").mkdir(parents=True)
    (run / "report.json").write_text(json.dumps({"log_path": str(log)}))
    (run / "eskf.tum").write_text("0 0 0 0 0 0 0 1\n")
    (run / "map.pcd").write_text("large")
    (run / "logs" / "lio_frontend.log").write_text("a" * 2_000_000 + "the end")
    assert main([str(run), "-o", str(tmp_path / "b.tar.gz")]) == 0
    inside = extracted(tmp_path / "b.tar.gz", tmp_path / "x")
    names = {str(path.relative_to(inside)) for path in inside.rglob("*") if path.is_file()}
    assert {"report.json", "eskf.tum", "last_60_s.lcmlog", "logs/lio_frontend.log"} <= names and "map.pcd" not in names
    said = (inside / "logs" / "lio_frontend.log").read_text()
    assert len(said) == 1_000_000 and said.endswith("the end")
    log.unlink()
    assert main([str(run), "-o", str(tmp_path / "c.tar.gz")]) == 0
    assert "no longer lies" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("source", "more", "said"),
    [
        ("none", [], "does not exist"),
        (".", [], "is no results folder"),
        ("notes.txt", [], "of no known kind"),
        ("a.lcmlog", ["--seconds", "0"], "allowed is more than 0"),
    ],
)
def test_refusals(source: str, more: list[str], said: str, tmp_path: Path, capsys) -> None:
    write_live_log(tmp_path / "a.lcmlog", 0.1)
    (tmp_path / "notes.txt").write_text("hello\n" * 50)
    assert main([str(tmp_path / source), "-o", str(tmp_path / "b.tar.gz"), *more]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "b.tar.gz").exists()
