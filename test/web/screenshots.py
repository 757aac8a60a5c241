# SPDX-License-Identifier: Apache-2.0
"""Takes the pictures of docs/view.md: drives a scene through the real processes and photographs the page.

./ignis shell python3 test/web/screenshots.py SCENE OUT.png [--at SECONDS] [--size 1440x900] [--light] [--keys KEYS]
    [--config FILE]
With --loop, OUT names two pictures: OUT_before_loop.png and OUT_after_loop.png, from above the start.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright
from view_page import ARGUMENTS, CHROMIUM, ViewPage

from ignis.pipeline import Pipeline, effective_config, enter_private_network

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
PORT = 18099
COLOURS = 256  # of the palette: keeps a picture below 400 kB


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("out", type=Path)
    parser.add_argument("--at", type=float, default=40.0, help="seconds of the drive")
    parser.add_argument("--size", default="1440x900")
    parser.add_argument("--light", action="store_true")
    parser.add_argument("--loop", action="store_true", help="before and after the first loop")
    parser.add_argument("--keys", default="", help="keys to press first, comma-separated, such as -,-,ArrowUp")
    parser.add_argument("--config", type=Path, default=CHECKOUT / "config" / "ignis8_tuned.json")
    options = parser.parse_args()
    enter_private_network()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        with Pipeline(Path(folder), effective_config(options.config)["lcm"]["url"]) as pipeline:
            start(pipeline, options, Path(folder) / "l1.pty")
            view = ViewPage(
                browser, f"http://127.0.0.1:{PORT}/", width, height, color_scheme="light" if options.light else "dark"
            )
            view.wait(30, "a map", lambda: sum(view.hook("counts")) > 100)
            for key in filter(None, options.keys.split(",")):
                view.page.keyboard.press(key)
            if options.loop:
                photograph_loop(view, options.out)
            else:
                view.page.wait_for_timeout(1000 * options.at)
                photograph(view, options.out)
            view.close()
        browser.close()
    return 0


def start(pipeline: Pipeline, options: argparse.Namespace, tty: Path) -> None:
    config = ("--config", options.config)
    pipeline.start("map_builder", *config, "--port", PORT)
    pipeline.start("graph_backend", *config)
    pipeline.start("lio_frontend", *config)
    scene = CHECKOUT / "config" / "scenes" / f"{options.scene}.json"
    pipeline.start("l1_sim", "--scene", scene, *config, "--pty", tty, "--wait", 20)
    pipeline.wait_for_text("l1_sim", "waiting", 20.0)
    pipeline.start("l1_driver", *config, "--port", tty)


def photograph_loop(view: ViewPage, out: Path) -> None:
    """The newest picture without a loop, and one of two seconds after the first."""
    before = out.with_name(f"{out.name}_before_loop.png")
    deadline = time.monotonic() + 300

    def has_loop() -> bool:
        return any(loop["stage"] in ("on_trial", "kept") for loop in view.hook("loops"))

    while not has_loop():
        assert time.monotonic() < deadline, "no loop was closed"
        newest = out.with_name(f"{out.name}_newest.png")
        photograph(view, newest)
        if not has_loop():
            newest.replace(before)
        newest.unlink(missing_ok=True)
    view.page.wait_for_timeout(2000)
    photograph(view, out.with_name(f"{out.name}_after_loop.png"))


def photograph(view: ViewPage, path: Path) -> None:
    view.screenshot(path)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
