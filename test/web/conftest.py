# SPDX-License-Identifier: Apache-2.0
"""A browser in a network of its own."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, sync_playwright

from view_page import launch


@pytest.fixture(scope="module")
def browser(private_network, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Headless Chromium; started after the network was made, so that it sees no other."""
    with sync_playwright() as playwright:
        chromium = launch(playwright, tmp_path_factory.mktemp("browser"))
        yield chromium
        chromium.close()
