# SPDX-License-Identifier: Apache-2.0
"""The browser view in headless Chromium, and what a test wants to know of it."""

from __future__ import annotations

import json
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import Browser, Page, Playwright

CHROMIUM = "/usr/bin/chromium"
# Software rendering: there is no graphics card in a test.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def launch(playwright: Playwright, folder: Path) -> Browser:
    """Headless Chromium. Drawing in software must not take the processors from the processes that drive."""
    behind = folder / "chromium"
    behind.write_text(f'#!/bin/sh\nexec nice -n 15 {CHROMIUM} "$@"\n')
    behind.chmod(0o755)
    return playwright.chromium.launch(executable_path=behind, args=ARGUMENTS)


class ViewPage:
    """One tab with the view. Keeps console errors, page errors and the hosts of all requests."""

    def __init__(self, browser: Browser, address: str, width: int = 960, height: int = 600, **options: Any) -> None:
        self.address = address
        self.errors: list[str] = []
        self.hosts: set[str] = set()
        self.context = browser.new_context(
            viewport={"width": width, "height": height},
            **{"color_scheme": "dark", "reduced_motion": "reduce", **options},
        )
        self.page: Page = self.context.new_page()
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.hosts.add(urlsplit(request.url).netloc))
        self.page.goto(address)

    def close(self) -> None:
        self.context.close()

    def hook(self, *fields: str) -> Any:
        """One field of window.__ignis, or several at one instant."""
        values = self.page.evaluate("names => names.map(name => window.__ignis[name])", list(fields))
        return values[0] if len(fields) == 1 else values

    def text(self, test_id: str) -> str:
        return self.page.get_by_test_id(test_id).inner_text()

    def audit(self) -> dict[str, Any]:
        """Counts and checksum of the voxels in the buffers of the graphics card."""
        return self.page.evaluate("() => window.__ignis.audit()")

    def knobs(self) -> list[dict[str, float]]:
        """Where loops can be clicked: from, to, x, y."""
        return self.page.evaluate("() => window.__ignis.knobs()")

    def wait(self, seconds: float, what: str, holds: Callable[[], Any]) -> Any:
        """The first true value of `holds`. The page's own waiting functions need eval, which its policy forbids."""
        deadline = time.monotonic() + seconds
        while not (value := holds()):
            assert time.monotonic() < deadline, f"not within {seconds:.0f} s: {what}; {self.describe()}"
            self.page.wait_for_timeout(100)
        return value

    def describe(self) -> str:
        fields = ("connected", "connections", "sequence", "counts", "snapshots", "errors", "drawn", "servedRadius")
        return f"{dict(zip(fields, self.hook(*fields), strict=True))}; console: {self.errors}"

    def wait_for_map(self, seconds: float = 20.0) -> None:
        self.wait(seconds, "a map on the screen", lambda: self.hook("sequence") > 0 and sum(self.hook("counts")) > 0)

    def screenshot(self, path: Path) -> None:
        self.page.screenshot(path=path)

    def status(self) -> dict[str, Any]:
        """What the server says of itself."""
        with urllib.request.urlopen(f"{self.address}api/status", timeout=5) as answer:
            return json.load(answer)
