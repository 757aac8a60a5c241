# SPDX-License-Identifier: Apache-2.0
"""What a replay has to say about the live run in its log."""

from typing import Any


def require_equal_up_to_the_first_drop(report: dict[str, Any]) -> None:
    """Front end and back end, bit for bit: all of it, or up to the drop that the replay names.

    A busy machine loses datagrams, in the recorder as well; what lies behind the first loss proves nothing.
    """
    agreement, drop = report["live"], report["input"]["first_drop"]
    graph = {name: channel for name, channel in agreement["graph"].items() if name != "first_command_s"}
    firsts = [agreement["first_unequal_s"], *(channel["first_unequal_s"] for channel in graph.values())]
    if drop is None:
        assert agreement["equal_scans"] == agreement["recorded_scans"], agreement
        assert all(channel["equal"] == channel["recorded"] for channel in graph.values()), graph
    else:
        assert all(first is None or first >= drop["s"] for first in firsts), (agreement, drop)
