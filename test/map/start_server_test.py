# SPDX-License-Identifier: Apache-2.0
"""A test that fails and leaves its server behind must not fail those after it."""

import pytest

from map_drive import URL


@pytest.mark.xfail(raises=AssertionError, strict=True, reason="fails on purpose, while its server runs")
def test_one_that_fails(private_network: None, start_server) -> None:
    server = start_server("--port", "0", url=URL)
    assert server.port == 0


def test_the_next_one_has_the_bus_for_itself(private_network: None, start_server) -> None:
    server = start_server("--port", "0", url=URL)
    assert server.stop() == 0
