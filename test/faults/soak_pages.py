# SPDX-License-Identifier: Apache-2.0
"""Real browsers that watch a soak: whether they stay connected, fall over anything, and how much memory they take."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from playwright.sync_api import CDPSession, sync_playwright

from view_page import ViewPage, launch

PERIOD_S = 30.0  # between two looks at the memory
SIZE = {"width": 320, "height": 200}  # drawn in software, beside the processes that drive


class WatchedPages:
    """The view in some headless Chromiums, a tab each, as viewers on computers of their own have it."""

    def __init__(self, address: str, number: int, folder: Path) -> None:
        self._address, self._number, self._folder = address, number, folder
        self._browsers = ExitStack()
        self._pages: list[tuple[ViewPage, CDPSession]] = []
        self._heaps_mb: list[list[float]] = []
        self._next_look_s = 0.0

    def __enter__(self) -> WatchedPages:
        if self._number == 0:
            return self
        with ExitStack() as started:  # and ended again should one of them not start
            playwright = started.enter_context(sync_playwright())
            for index in range(self._number):
                folder = self._folder / f"browser{index}"
                folder.mkdir()
                browser = launch(playwright, folder)
                started.callback(browser.close)
                view = ViewPage(browser, self._address, **SIZE)
                session = view.context.new_cdp_session(view.page)
                session.send("Performance.enable")
                self._pages.append((view, session))
                self._heaps_mb.append([])
            self._browsers = started.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        self._browsers.close()

    def look(self, now_s: float) -> None:
        """Notes what the pages' scripts hold, every now and then."""
        if now_s < self._next_look_s:
            return
        self._next_look_s = now_s + PERIOD_S
        for (view, session), heaps in zip(self._pages, self._heaps_mb, strict=True):
            view.page.wait_for_timeout(1)  # takes what the page has said meanwhile
            metrics = session.send("Performance.getMetrics")["metrics"]
            heaps.append(next(metric["value"] for metric in metrics if metric["name"] == "JSHeapUsedSize") / 1e6)

    def figures(self) -> list[dict[str, Any]]:
        """What each page has seen, at the end."""
        names = ("connected", "connections", "snapshots", "deltas", "resyncs", "errors", "counts")
        return [
            {
                **dict(zip(names, view.hook(*names), strict=True)),
                "console_errors": list(view.errors),
                "heap_mb": [round(heap, 1) for heap in heaps],
            }
            for (view, _), heaps in zip(self._pages, self._heaps_mb, strict=True)
        ]


def troubles(pages: list[dict[str, Any]]) -> list[str]:
    """What is wrong with them, in words."""
    found = []
    for index, page in enumerate(pages):
        if not page["connected"] or page["connections"] != 1:
            found.append(f"page {index} was connected {page['connections']} times, now: {page['connected']}")
        if page["errors"] or page["console_errors"]:
            found.append(f"page {index} fell over something: {page['errors']} errors, {page['console_errors']}")
        if sum(page["counts"]) == 0:
            found.append(f"page {index} shows nothing")
    return found
