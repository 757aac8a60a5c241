# SPDX-License-Identifier: Apache-2.0
"""A browser in a network of its own."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

sys.path.insert(0, str(Path(__file__).parent))

from view_page import ARGUMENTS, CHROMIUM


@pytest.fixture(scope="module")
def browser(private_network, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Headless Chromium; started after the network was made, so that it sees no other."""
    # Drawing in software must not take the processors from the processes that drive.
    behind = tmp_path_factory.mktemp("browser") / "chromium"
    behind.write_text(f'#!/bin/sh\nexec nice -n 15 {CHROMIUM} "$@"\n')
    behind.chmod(0o755)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=behind, args=ARGUMENTS)
        yield chromium
        chromium.close()
