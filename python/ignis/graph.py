# SPDX-License-Identifier: Apache-2.0
"""Tells the running back end to withdraw or veto a loop, or to publish all keyframes, and shows its answer."""

from __future__ import annotations

import argparse
import os
import sys

from ignis_lcm.ignis import graph_command_t, loop_result_t, smoothed_keyframes_t

from ignis.bus import Bus, default_url, open_bus
from ignis.errors import InputError

ANSWER_SECONDS = 3.0
ATTEMPTS = 3


def keyframe_id(text: str) -> int:
    """A keyframe's id as an argument."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{value} is no keyframe: 0 or more")
    return value


def parse_arguments(arguments: list[str] | None) -> argparse.Namespace:
    """The command line; ends with code 2 and one message when it is wrong."""
    parser = argparse.ArgumentParser(prog="ignis graph", description=__doc__)
    parser.add_argument("--lcm-url", default=default_url())
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in (
        ("withdraw", "take a loop out of the graph; a later match may close it again"),
        ("veto", "take it out and never close these two places again"),
    ):
        loop = commands.add_parser(name, help=text)
        loop.add_argument("from_id", type=keyframe_id, help="the later keyframe")
        loop.add_argument("to_id", type=keyframe_id, help="the earlier keyframe")
    commands.add_parser("full", help="have all keyframes published at once")
    return parser.parse_args(arguments)


def message_of(arguments: argparse.Namespace) -> graph_command_t:
    """The command as a message."""
    message = graph_command_t()
    message.session = -1
    message.sender = f"ignis graph {os.getpid()}"
    message.command = {
        "withdraw": graph_command_t.WITHDRAW_LOOP,
        "veto": graph_command_t.VETO_LOOP,
        "full": graph_command_t.SEND_FULL_SET,
    }[arguments.command]
    message.from_id = getattr(arguments, "from_id", -1)
    message.to_id = getattr(arguments, "to_id", -1)
    return message


class Answer:
    """Waits for what the back end says to a command."""

    def __init__(self, bus: Bus, command: graph_command_t) -> None:
        self.text = ""
        self._command = command
        wants_all = command.command == graph_command_t.SEND_FULL_SET
        bus.subscribe(
            "SMOOTHED_KEYFRAMES" if wants_all else "LOOP_RESULT", self._on_set if wants_all else self._on_loop
        )

    def _on_loop(self, _: str, data: bytes) -> None:
        loop = loop_result_t.decode(data)
        if {loop.from_id, loop.to_id} == {self._command.from_id, self._command.to_id}:
            self.text = f"loop {loop.from_id}-{loop.to_id}: {loop.reason_text}"

    def _on_set(self, _: str, data: bytes) -> None:
        part = smoothed_keyframes_t.decode(data)
        if part.full:
            self.text = f"revision {part.revision}, session {part.session}: {part.graph_keyframes} keyframes sent"


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    options = parse_arguments(arguments)
    try:
        bus = open_bus(options.lcm_url)
    except InputError as error:
        print(f"ignis graph: {error}", file=sys.stderr)
        return 1
    command = message_of(options)
    answer = Answer(bus, command)
    # A datagram may be lost; a command that is carried out twice does no harm.
    for attempt in range(ATTEMPTS):
        command.sequence = attempt
        bus.publish("GRAPH_COMMAND", command.encode())
        if bus.wait_until(lambda: bool(answer.text), ANSWER_SECONDS / ATTEMPTS):
            print(answer.text)
            return 0
    print(
        f"ignis graph: no answer within {ANSWER_SECONDS:.0f} s; is graph_backend running on {options.lcm_url}?",
        file=sys.stderr,
    )
    return 1


if __name__ == "__main__":
    sys.exit(main())
