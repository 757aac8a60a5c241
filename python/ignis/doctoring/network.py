# SPDX-License-Identifier: Apache-2.0
"""The bus: URL, TTL, route of its multicast group, loopback; and the view's port."""

from __future__ import annotations

import json
import os
import socket
import subprocess
from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ignis.doctoring.finding import Finding, Severity

_ROUTE_FIX = "sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo"
_MIN_BUFFER = 1 << 20


def check_bus(config: dict[str, Any], *, view_is_ours: bool = False) -> Iterator[Finding]:
    """All of this module. `view_is_ours`: a map_builder is on the bus, so the port is rightly taken."""
    url = os.environ.get("LCM_DEFAULT_URL") or config["lcm"]["url"]
    if url != config["lcm"]["url"]:
        yield Finding(
            "bus",
            "url",
            Severity.WARNING,
            f"LCM_DEFAULT_URL is {url}, the configuration says {config['lcm']['url']}: every process needs the same",
            f"export LCM_DEFAULT_URL='{config['lcm']['url']}'",
        )
    yield from check_url(url)
    if url.startswith("udpm:"):
        yield from check_route(url)
    if not view_is_ours:
        yield check_port(config["hmi"]["address"], config["hmi"]["port"])


def _parts(url: str) -> tuple[str, int, int]:
    """Group, TTL and receive buffer of an udpm URL."""
    split = urlsplit(url)
    query = {key: values[-1] for key, values in parse_qs(split.query).items()}
    return split.hostname or "239.255.76.67", int(query.get("ttl", 0)), int(query.get("recv_buf_size", 0))


def reaches_other_computers(url: str) -> bool:
    """Whether messages leave this computer; False when the URL cannot be understood, which check_url says."""
    try:
        return url.startswith("udpm:") and _parts(url)[1] > 0
    except ValueError:
        return False


def check_url(url: str) -> Iterator[Finding]:
    """TTL and receive buffer."""
    if not url.startswith("udpm:"):
        yield Finding("bus", "url", Severity.WARNING, f"{url} is no multicast bus; the vehicle runs on udpm")
        return
    try:
        group, ttl, buffer = _parts(url)
    except ValueError:
        fix = "export LCM_DEFAULT_URL='udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152'"
        yield Finding("bus", "url", Severity.ERROR, f"{url}: ttl and recv_buf_size must be whole numbers", fix)
        return
    reach = {0: "stays on this computer", 1: "reaches this subnet"}.get(ttl, "leaves the subnet")
    yield Finding(
        "bus",
        "ttl",
        Severity.OK if ttl <= 1 else Severity.WARNING,
        f"group {group}, TTL {ttl}: {reach}",
        "" if ttl <= 1 else f"export LCM_DEFAULT_URL='{url.replace(f'ttl={ttl}', 'ttl=1')}'",
    )
    if buffer < _MIN_BUFFER:
        joint = "&" if "?" in url else "?"
        wanted = f"{url.split('&recv_buf_size')[0]}{joint}recv_buf_size=2097152"
        yield Finding(
            "bus",
            "receive buffer",
            Severity.WARNING,
            f"the URL asks for {buffer or 'no'} bytes of receive buffer: bursts are lost",
            f"export LCM_DEFAULT_URL='{wanted}'",
        )


def check_route(url: str) -> Iterator[Finding]:
    """Whether the group has a route, and through which interface."""
    try:
        group, ttl, _ = _parts(url)
    except ValueError:
        return
    done = subprocess.run(["ip", "-j", "route", "get", group], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        yield Finding("bus", "route", Severity.ERROR, f"multicast to {group} has no route", _ROUTE_FIX)
        return
    device = json.loads(done.stdout)[0].get("dev", "?")
    link = subprocess.run(["ip", "-j", "link", "show", device], capture_output=True, text=True, check=False)
    flags = json.loads(link.stdout)[0].get("flags", []) if link.returncode == 0 else []
    if "MULTICAST" not in flags or "UP" not in flags:
        wrong = "is down" if "UP" not in flags else "carries no multicast"
        fix = f"sudo ip link set {device} up multicast on"
        yield Finding("bus", "route", Severity.ERROR, f"multicast goes through {device}, which {wrong}", fix)
    elif ttl > 0 and device == "lo":
        yield Finding(
            "bus",
            "route",
            Severity.ERROR,
            f"TTL {ttl} is meant for several computers, but multicast goes through lo: others hear nothing",
            "sudo ip route del 224.0.0.0/4 dev lo; sudo ip route add 224.0.0.0/4 dev eth0   # the others' link",
        )
    else:
        yield Finding("bus", "route", Severity.OK, f"multicast goes through {device}")


def check_port(address: str, port: int) -> Finding:
    """Whether map_builder could open the view's port."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError as error:
            why = error.strerror or str(error)
            fix = f"ss -ltnp 'sport = :{port}'   # who has it; or set hmi.port"
            return Finding("bus", "view port", Severity.ERROR, f"{address}:{port} cannot be opened: {why}", fix)
    return Finding("bus", "view port", Severity.OK, f"{address}:{port} is free")
