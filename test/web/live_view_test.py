# SPDX-License-Identifier: Apache-2.0
"""The browser view during and after a simulated drive through the real processes."""

from collections.abc import Iterator

import numpy as np
import pytest
from matplotlib.image import imread
from playwright.sync_api import Browser

from live_drive import LiveDrive
from view_page import ViewPage


@pytest.fixture(scope="module")
def drive(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveDrive]:
    """Drives once. The tests below look at what was seen, then at the page that is still open."""
    live = LiveDrive(tmp_path_factory.mktemp("view"), browser)
    try:
        live.drive()
        yield live
    finally:
        live.close()


# --- while driving ----------------------------------------------------------------------------------------------------


def test_voxels_equal_the_servers_at_every_frame(drive: LiveDrive) -> None:
    assert len(drive.applied) > 200
    for frame in drive.applied.values():
        assert frame["checksum"] == frame["announcedChecksum"], frame
        assert frame["counts"] == frame["announcedCounts"], frame
    assert drive.view.hook("resyncs", "errors") == [0, 0]
    assert drive.view.hook("deltas") > 10 * drive.view.hook("snapshots")


def test_page_held_what_the_status_page_says(drive: LiveDrive) -> None:
    held = {(frame["revision"], frame["checksum"], tuple(frame["counts"])) for frame in drive.applied.values()}
    views = [view for status in drive.statuses for view in status["views"] if view["utime"] > 0]
    revisions = {view["revision"] for view in views}
    shown_revisions = {frame["revision"] for frame in drive.applied.values()}
    agreed = [view for view in views if (view["revision"], view["checksum"], tuple(view["counts"])) in held]
    assert len(revisions) > 5
    assert shown_revisions >= revisions - {max(revisions)}
    # The status names one picture a second; while this viewer was busy it may be one between two of its frames.
    assert len(agreed) > 0.7 * len(views), (len(agreed), len(views))


def test_figures_equal_the_published_pose(drive: LiveDrive) -> None:
    compared = 0
    for hud, texts in drive.figures:
        state = hud["state"]
        published = drive.listener.states.get(state["utime"])
        if published is None:
            continue
        compared += 1
        for name in ("yaw", "pitch", "roll"):
            assert state[f"{name}_deg"] == pytest.approx(np.degrees(getattr(published, name)), abs=1e-9)
            assert texts[f"hud-{name}"] == shown(state[f"{name}_deg"], 1) + "°"
        for name in ("right", "up", "forward"):
            assert state[f"{name}_mps"] == pytest.approx(getattr(published, f"velocity_{name}"), abs=1e-9)
            assert texts[f"hud-{name}"] == shown(state[f"{name}_mps"], 2)
    assert compared > 50, (len(drive.figures), len(drive.listener.states))


def test_position_equals_the_smoothed_state(drive: LiveDrive) -> None:
    stamps = np.array([message.utime for message in drive.listener.smoothed])
    positions = np.array([message.position for message in drive.listener.smoothed])
    states = [hud["state"] for hud, _ in drive.figures if hud["state"] and hud["state"]["utime"] > stamps[0]]
    assert len(states) > 50
    for state in states:
        nearest = np.argmin(np.abs(stamps - state["utime"]))
        if abs(stamps[nearest] - state["utime"]) < 60_000:
            # 60 ms at 1.5 m/s, and a correction that one of the two has not heard of yet.
            assert np.linalg.norm(positions[nearest] - state["position"]) < 0.25


def test_vehicle_stands_where_the_pose_says(drive: LiveDrive) -> None:
    def stands() -> bool:
        hud, vehicle = drive.view.hook("hud", "vehicle")
        return np.allclose(hud["state"]["position"], vehicle, atol=1e-3)

    drive.view.wait(10, "the vehicle at its pose", stands)
    assert np.ptp(np.array(drive.vehicle)[:, [0, 2]], axis=0).min() > 5.0


def test_loop_is_seen_on_two_screenshots(drive: LiveDrive) -> None:
    assert drive.after_loop.exists(), f"no loop came in; the page knew {drive.loops}, the server {drive.statuses[-1]}"
    before, after = imread(drive.before_loop), imread(drive.after_loop)
    assert before.shape == after.shape
    assert (np.abs(before - after).max(axis=2) > 0.1).mean() > 0.01
    kept = [loop for loop in drive.view.hook("loops") if loop["stage"] in ("on_trial", "kept")]
    assert kept and drive.view.text("hud-loops").startswith(str(len(kept)))


def test_lost_is_spoken_and_taken_back(drive: LiveDrive) -> None:
    assert drive.alarms[0].startswith("Lost.") and drive.alarms[-1] == "found"


def test_page_asks_no_other_host_and_complains_of_nothing(drive: LiveDrive) -> None:
    assert drive.view.hosts == {drive.view.address.split("/")[2]}
    assert drive.view.errors == []


# --- after the drive, the same page -----------------------------------------------------------------------------------


def test_silence_is_shown_as_stale(drive: LiveDrive) -> None:
    banner = drive.view.page.get_by_test_id("banner")
    drive.view.wait(
        10, "the stale banner", lambda: banner.get_attribute("data-kind") == "stale" and banner.is_visible()
    )
    assert "stale" in banner.inner_text()
    assert drive.view.page.evaluate("() => getComputedStyle(document.getElementById('map')).filter") != "none"


def test_buffers_on_the_card_hold_the_same_voxels(drive: LiveDrive) -> None:
    counts, checksum = drive.view.hook("counts", "checksum")
    assert drive.view.audit() == {"counts": counts, "checksum": checksum}
    for level in range(3):
        assert drive.view.text(f"voxels-{level}") == f"{counts[level]:,}"


def test_view_radius_goes_to_the_server_and_changes_what_is_sent(drive: LiveDrive) -> None:
    view = drive.view
    view.page.keyboard.press("r")
    view.wait(10, "a confirmed radius", lambda: view.hook("servedRadius") == view.hook("viewRadius"))
    near, sequence = view.hook("viewRadius", "sequence")
    for _ in range(9):
        view.page.keyboard.press("-")
    view.wait(10, "a larger radius", lambda: view.hook("servedRadius") == view.hook("viewRadius") > 2 * near)
    view.wait(10, "a frame of it", lambda: view.hook("sequence") > sequence)
    assert_as_status(view)
    view.page.keyboard.press("r")
    view.wait(10, "the radius as before", lambda: abs(view.hook("servedRadius") - near) < 0.06 * near)


def test_pinch_zooms(drive: LiveDrive) -> None:
    view = drive.view
    session = view.context.new_cdp_session(view.page)
    before = view.hook("viewRadius")

    def touch(kind: str, half: float) -> None:
        points = (
            [] if kind == "touchEnd" else [{"x": 480 - half, "y": 400, "id": 0}, {"x": 480 + half, "y": 400, "id": 1}]
        )
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 60)
    for half in range(70, 200, 10):
        touch("touchMove", half)
    touch("touchEnd", 0)
    view.wait(5, "a smaller radius", lambda: view.hook("viewRadius") < 0.6 * before)
    view.page.keyboard.press("r")


def test_chosen_loop_shows_its_figures_and_clouds(drive: LiveDrive) -> None:
    view = drive.view
    view.page.get_by_test_id("open-loops").click()
    view.page.get_by_test_id("loop-list").get_by_role("button", name="kept").or_(
        view.page.get_by_test_id("loop-list").get_by_role("button", name="on trial")
    ).first.click()
    view.wait(10, "both clouds", lambda: min(view.hook("loopClouds")) > 100)
    assert view.text("loop-from-points") == f"{view.hook('loopClouds')[0]:,}"
    assert view.text("loop-residual").endswith("mm") and view.text("loop-matched").endswith("%")
    assert view.text("loop-reason")


def test_a_click_on_a_loops_knob_chooses_it(drive: LiveDrive) -> None:
    view = drive.view
    view.page.keyboard.press("Escape")
    width, height = 960, 600

    def free(knob: dict[str, float]) -> bool:
        """On the canvas, under no panel, and not so near another knob that a click may mean that one."""
        near = [k for k in view.knobs() if np.hypot(k["x"] - knob["x"], k["y"] - knob["y"]) < 16]
        inside = 0 < knob["x"] < width and 0 < knob["y"] < height
        script = "([x, y]) => document.elementFromPoint(x, y)?.id"
        return len(near) == 1 and inside and view.page.evaluate(script, [knob["x"], knob["y"]]) == "map"

    knob = view.wait(20, "a knob in sight", lambda: next(filter(free, view.knobs()), None))
    view.page.mouse.click(knob["x"], knob["y"])
    title = f"{knob['from']:.0f} → {knob['to']:.0f}"
    view.wait(5, "the loop that was clicked", lambda: view.text("loop-title") == title)


def test_withdrawing_asks_first_and_reaches_the_back_end(drive: LiveDrive) -> None:
    view = drive.view
    title = view.text("loop-title").split(" → ")
    view.page.get_by_test_id("withdraw").click()
    view.page.get_by_test_id("confirm-no").click()
    view.page.wait_for_timeout(300)
    assert not drive.listener.commands
    view.page.get_by_test_id("withdraw").click()
    view.page.get_by_test_id("confirm-yes").click()
    view.wait(10, "the command", lambda: drive.listener.commands)
    command = drive.listener.commands[0]
    assert [command.command, command.from_id, command.to_id] == [command.WITHDRAW_LOOP, int(title[0]), int(title[1])]
    view.wait(10, "the back end's answer", lambda: view.text("loop-stage") == "withdrawn")


def test_a_veto_reaches_the_back_end(drive: LiveDrive) -> None:
    view = drive.view
    title = view.text("loop-title").split(" → ")
    view.page.get_by_test_id("veto").click()
    assert "never" in view.text("confirm")
    view.page.get_by_test_id("confirm-yes").click()
    command = view.wait(10, "the command", lambda: drive.listener.commands[1:])[0]
    assert [command.command, command.from_id, command.to_id] == [command.VETO_LOOP, int(title[0]), int(title[1])]


def test_an_event_leads_back_to_where_it_happened(drive: LiveDrive) -> None:
    view = drive.view
    marks = view.page.get_by_test_id("event-track").get_by_role("button")
    view.wait(5, "events", lambda: marks.count() > 0)
    where = drive.view.hook("cameraTarget")
    marks.first.click(force=True)
    view.wait(5, "the camera's flight", lambda: np.linalg.norm(np.subtract(view.hook("cameraTarget"), where)) > 0.5)
    assert view.text("event-line")
    view.page.keyboard.press("r")


def test_keys_themes_and_help(drive: LiveDrive) -> None:
    view = drive.view
    view.page.locator("body").click(position={"x": 480, "y": 330})
    view.page.keyboard.press("?")
    assert view.page.get_by_test_id("help").is_visible()
    view.page.keyboard.press("Escape")
    assert not view.page.get_by_test_id("help").is_visible()
    theme = "() => document.documentElement.dataset.theme"
    assert view.page.evaluate(theme) == "dark"
    view.page.keyboard.press("d")
    assert view.page.evaluate(theme) == "light"
    view.page.keyboard.press("d")
    for key, colour in (("2", "intensity"), ("3", "level"), ("4", "age"), ("1", "height")):
        view.page.keyboard.press(key)
        assert view.page.locator(f"input[value={colour}]").is_checked()


def test_every_control_has_a_name(drive: LiveDrive) -> None:
    session = drive.view.context.new_cdp_session(drive.view.page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    roles = ("button", "slider", "checkbox", "radio", "combobox", "link")
    controls = [node for node in nodes if node.get("role", {}).get("value") in roles]
    assert len(controls) > 15
    assert [node for node in controls if not node.get("name", {}).get("value")] == []


def test_page_reconnects_to_a_restarted_server(drive: LiveDrive) -> None:
    view = drive.view
    assert view.hook("connections") == 1
    frames = view.hook("sequence")
    drive.stop_map_builder()
    banner = view.page.get_by_test_id("banner")
    view.wait(10, "the banner", lambda: banner.get_attribute("data-kind") == "gone" and banner.is_visible())
    view.page.wait_for_timeout(1000)
    drive.start_map_builder()
    view.wait(15, "a new connection", lambda: view.hook("connections") == 2 and view.hook("connected"))
    # The new server asks for the keyframes that it never had, and builds the map from them.
    view.wait(20, "the map again", lambda: view.hook("sequence") < frames and view.hook("counts")[0] > 1000)
    assert_as_status(view)
    assert view.audit()["checksum"] == view.hook("checksum")
    # Chromium itself notes the refused attempts; nothing else went wrong.
    assert [error for error in view.errors if "ERR_CONNECTION_REFUSED" not in error] == []


@pytest.mark.parametrize("width,height", [(390, 844), (844, 390), (820, 1180)])
def test_phone_and_tablet_show_all_controls(drive: LiveDrive, browser: Browser, width: int, height: int) -> None:
    view = ViewPage(browser, drive.view.address, width, height, has_touch=True)
    view.wait_for_map()
    assert view.page.evaluate("() => document.documentElement.scrollWidth") <= width
    for test_id in ("reset", "theme", "open-help", "timeline", "tracking"):
        box = view.page.get_by_test_id(test_id).bounding_box()
        assert box and box["x"] >= 0 and box["x"] + box["width"] <= width, test_id
        assert box["y"] >= 0 and box["y"] + box["height"] <= height, test_id
    assert view.errors == []
    view.close()


def assert_as_status(view: ViewPage) -> None:
    """The server's own status names what this page holds."""

    def named() -> bool:
        held = [*view.hook("revision", "checksum", "counts")]
        return any([each["revision"], each["checksum"], each["counts"]] == held for each in view.status()["views"])

    view.wait(10, "the status page names the page's voxels", named)


def shown(value: float, digits: int) -> str:
    """As the page writes numbers. Ties round as JavaScript does, which takes the binary value as it is."""
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "\N{MINUS SIGN}")
