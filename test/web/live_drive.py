# SPDX-License-Identifier: Apache-2.0
"""A simulated drive through the real processes with the view open in a browser, and what was seen meanwhile."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser

from bus_listener import BusListener
from ignis.pipeline import Pipeline, effective_config
from view_page import ViewPage

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
PORT = 18090
SCREENSHOT_SECONDS = 6.0  # software rendering takes a second for each
FIGURES = ("hud-yaw", "hud-pitch", "hud-roll", "hud-right", "hud-up", "hud-forward", "hud-scan", "hud-keyframes")


class LiveDrive:
    """All processes, the page and a listener. `drive` lasts as long as the simulated drive."""

    def __init__(self, folder: Path, browser: Browser) -> None:
        self.folder = folder
        url = effective_config(CONFIG)["lcm"]["url"]
        self.pipeline = Pipeline(folder, url)
        self.listener = BusListener(url)
        self.start_map_builder()
        self.view = ViewPage(browser, f"http://127.0.0.1:{PORT}/")
        self.figures: list[tuple[dict[str, Any], dict[str, str]]] = []  # the hook's hud and the page's texts
        self.applied: dict[int, dict[str, Any]] = {}  # by sequence
        self.statuses: list[dict[str, Any]] = []
        self.vehicle: list[list[float]] = []
        self.alarms: list[str] = []
        self.loops: list[dict[str, Any]] = []  # as the page knew them at the last look
        self.next_status = self.next_screenshot = 0.0
        self.before_loop = folder / "before_loop.png"
        self.after_loop = folder / "after_loop.png"

    def start_map_builder(self) -> None:
        self.pipeline.start("map_builder", "--config", CONFIG, "--port", PORT)
        self.pipeline.wait_for_text("map_builder", "http://", 20.0)

    def stop_map_builder(self) -> None:
        self.pipeline.stop("map_builder")

    def close(self) -> None:
        self.view.close()
        self.listener.close()
        self.pipeline.stop(*reversed(self.pipeline.processes))

    def drive(self) -> None:
        config = ("--config", CONFIG)
        tty = self.folder / "l1.pty"
        self.pipeline.start("graph_backend", *config)
        self.pipeline.start("lio_frontend", *config)
        simulator = self.pipeline.start("l1_sim", "--scene", SCENE, *config, "--pty", tty, "--wait", 20)
        self.pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        self.pipeline.start("l1_driver", *config, "--port", tty)
        self.view.wait(20.0, "the first pose", lambda: (self.view.hook("hud") or {}).get("state"))
        alarm_at = time.monotonic() + 8.0
        while simulator.poll() is None:
            self.pipeline.check("l1_sim")
            self.look()
            if alarm_at and time.monotonic() > alarm_at:
                self.raise_alarm()
                alarm_at = None
            self.view.page.wait_for_timeout(200)
        self.pipeline.processes.pop("l1_sim")
        assert simulator.returncode == 0, self.pipeline.last_words("l1_sim")
        self.look()

    def look(self) -> None:
        """One look at the page and at the server."""
        page = self.view.page
        hud, texts, applied, vehicle, loops = page.evaluate(
            """names => [window.__ignis.hud,
                 Object.fromEntries(names.map(n => [n, document.querySelector(`[data-testid="${n}"]`).innerText])),
                 window.__ignis.applied.splice(0), window.__ignis.vehicle, window.__ignis.loops]""",
            list(FIGURES),
        )
        self.figures.append((hud, texts))
        self.applied.update({entry["sequence"]: entry for entry in applied})
        self.vehicle.append(vehicle)
        self.loops = loops
        if not self.statuses or time.monotonic() > self.next_status:
            self.statuses.append(self.view.status())
            self.next_status = time.monotonic() + 1.0
        has_loop = any(loop["stage"] in ("on_trial", "kept") for loop in loops)
        if has_loop and not self.after_loop.exists():
            self.view.screenshot(self.after_loop)
        elif not has_loop and time.monotonic() > self.next_screenshot:
            self.view.screenshot(self.before_loop)
            self.next_screenshot = time.monotonic() + SCREENSHOT_SECONDS

    def raise_alarm(self) -> None:
        """Says on the bus that the front end is lost, as it would; its own next word takes that back."""
        from ignis_lcm.ignis import health_t

        lost = health_t()
        lost.process, lost.state, lost.state_text, lost.sequence = (
            "lio_frontend",
            health_t.LOST,
            "LOST: no match",
            10**6,
        )
        for _ in range(5):
            self.listener.publish("HEALTH", lost)
            self.view.page.wait_for_timeout(150)
            text = self.view.page.evaluate("() => document.querySelector('[data-testid=alarm]').textContent")
            if text.startswith("Lost"):
                self.alarms.append(text)
                break
        self.view.wait(
            5.0,
            "the alarm's end",
            lambda: (
                "Found" in self.view.page.evaluate("() => document.querySelector('[data-testid=alarm]').textContent")
            ),
        )
        self.alarms.append("found")
