# SPDX-License-Identifier: Apache-2.0
"""Row P5: the page behind a proxy that alters, cuts and swallows what the server sends, and goes away for a while."""

import threading
import time
from collections.abc import Iterator

import mutating_proxy
import pytest
from mutating_proxy import MutatingProxy
from playwright.sync_api import Browser

from map_drive import SCAN_PERIOD, URL, Drive
from stream_server import Server
from view_page import ViewPage

SEED = 11
DAMAGE_S = 1.5
GONE_S = 2.5
BACK_WITHIN_S = 2.0
BUSY_S = 3.0  # that a busy machine and drawing in software may add
WHOLE_WITHIN_S = 15.0


class Moving(threading.Thread):
    """A drive that goes on in the background."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.ended = threading.Event()
        self.start()

    def run(self) -> None:
        drive = Drive()
        while not self.ended.wait(SCAN_PERIOD):
            drive.advance()


@pytest.fixture(scope="module")
def proxy(private_network: None) -> Iterator[MutatingProxy]:
    """The proxy before a server that has something to show."""
    server, moving = Server("--port", "0", url=URL), Moving()
    with MutatingProxy(server.port, SEED) as between:
        yield between
    moving.ended.set()
    moving.join()
    assert server.stop() == 0


@pytest.fixture(scope="module")
def view(proxy: MutatingProxy, browser: Browser) -> Iterator[ViewPage]:
    page = ViewPage(browser, f"http://127.0.0.1:{proxy.port}/")
    page.wait_for_map()
    yield page
    page.close()


def own_errors(view: ViewPage) -> list[str]:
    """What the page complains of, but for the browser's own word about a connection that failed."""
    return [error for error in view.errors if not error.startswith("WebSocket connection to")]


def wait_until_whole(view: ViewPage) -> None:
    """The page is connected, goes on, and holds what the server announced."""
    # Frames are counted by the page itself: what a damaged announcement said of them may be anything.
    before = sum(view.hook("snapshots", "deltas"))

    def is_whole() -> bool:
        newest = view.hook("applied")[-1]
        return (
            view.hook("connected")
            and sum(view.hook("snapshots", "deltas")) > before
            and newest["checksum"] == newest["announcedChecksum"]
            and newest["counts"] == newest["announcedCounts"]
        )

    view.wait(WHOLE_WITHIN_S, "a whole map again", is_whole)


@pytest.mark.parametrize("damage", ["altered_voxels", "altered_texts", "truncated", "swallowed"])
def test_fault_p5_a_page_that_gets_damaged_messages_asks_again_and_is_whole_soon_after(
    damage: str, proxy: MutatingProxy, view: ViewPage
) -> None:
    damaged = proxy.damaged
    proxy.damage = getattr(mutating_proxy, damage)
    view.page.wait_for_timeout(1000 * DAMAGE_S)
    proxy.damage = mutating_proxy.none
    print(f"seed {SEED}: {proxy.damaged - damaged} messages damaged")
    assert proxy.damaged - damaged > 5
    wait_until_whole(view)
    assert own_errors(view) == []


def test_fault_p5_connections_that_end_within_a_frame_are_opened_again(proxy: MutatingProxy, view: ViewPage) -> None:
    connections = view.hook("connections")
    proxy.half_frames = 2
    view.wait(WHOLE_WITHIN_S, "both connections lost", lambda: view.hook("connections") >= connections + 2)
    wait_until_whole(view)
    assert own_errors(view) == []


def test_fault_p5_a_page_without_its_server_says_so_keeps_its_view_and_is_back_within_two_seconds(
    proxy: MutatingProxy, view: ViewPage
) -> None:
    proxy.close()
    banner = view.page.get_by_test_id("banner")
    view.wait(5, "the banner", lambda: banner.get_attribute("data-kind") == "gone" and banner.is_visible())
    view.page.wait_for_timeout(1000 * GONE_S)
    assert sum(view.hook("counts")) > 0, "the last view stays"
    proxy.open(proxy.port)
    back = time.monotonic()
    view.wait(WHOLE_WITHIN_S, "the connection", lambda: view.hook("connected"))
    took = time.monotonic() - back
    print(f"back after {took:.2f} s")
    assert took < BACK_WITHIN_S + BUSY_S
    wait_until_whole(view)
    counts, checksum = view.hook("counts", "checksum")
    assert own_errors(view) == []
    assert len(counts) == 3 and checksum
