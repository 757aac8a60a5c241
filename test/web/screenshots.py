# SPDX-License-Identifier: Apache-2.0
"""Takes the pictures of docs/view.md: drives a scene through the real processes and photographs the page.

./ignis sim --scene config/scenes/SCENE.json --out DIR --log
./ignis shell python3 test/web/screenshots.py DIR/drive.lcm OUT.png [--at SECONDS] [--size WxH] [--keys KEYS] ...

The log is played slowly: drawing in software takes what the processes need. With --loop, OUT is the beginning of two
names: OUT_before_loop.png and OUT_after_loop.png.
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

from ignis.pipeline import Pipeline, effective_config, enter_private_network
from view_page import ViewPage, launch

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
PORT = 18099
COLOURS = 256  # of the palette: keeps a picture below 400 kB


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--at", type=float, default=40.0, help="seconds of the drive")
    parser.add_argument("--speed", type=float, default=0.5, help="of playing the log")
    parser.add_argument("--size", default="1440x900")
    parser.add_argument("--light", action="store_true")
    parser.add_argument("--loop", action="store_true", help="before and after the first loop")
    parser.add_argument("--keys", default="", help="keys to press first, comma-separated, such as -,-,ArrowUp")
    parser.add_argument("--set", action="append", default=[], help="section.key=value for the front end")
    parser.add_argument("--config", type=Path, default=CHECKOUT / "config" / "ignis8_tuned.json")
    options = parser.parse_args()
    enter_private_network()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = launch(playwright, Path(folder))
        with Pipeline(Path(folder), effective_config(options.config)["lcm"]["url"]) as pipeline:
            start(pipeline, options)
            view = ViewPage(
                browser, f"http://127.0.0.1:{PORT}/", width, height, color_scheme="light" if options.light else "dark"
            )
            view.wait(30, "a map", lambda: sum(view.hook("counts")) > 100)
            for key in filter(None, options.keys.split(",")):
                view.page.keyboard.press(key)
            if options.loop:
                photograph_loop(view, options.out)
            else:
                view.page.wait_for_timeout(1000 * options.at / options.speed)
                photograph(view, options.out)
            view.close()
        browser.close()
    return 0


def start(pipeline: Pipeline, options: argparse.Namespace) -> None:
    config = ("--config", options.config)
    pipeline.start("map_builder", *config, "--port", PORT)
    pipeline.start("graph_backend", *config)
    settings = [word for each in options.set for word in ("--set", each)]
    pipeline.start("lio_frontend", *config, *settings)
    pipeline.wait_for_text("map_builder", "http://", 20.0)
    pipeline.start("lcm-logplayer", f"--speed={options.speed}", options.log)


def photograph_loop(view: ViewPage, out: Path) -> None:
    """The newest picture without a loop, and one of three seconds after the first."""
    before = out.with_name(f"{out.name}_before_loop.png")
    deadline = time.monotonic() + 300

    def has_loop() -> bool:
        return any(loop["stage"] in ("on_trial", "kept") for loop in view.hook("loops"))

    while not has_loop():
        assert time.monotonic() < deadline, "no loop was closed"
        newest = view.page.screenshot()
        if not has_loop():
            before.write_bytes(newest)
    view.page.wait_for_timeout(3000)
    shrink(before)
    photograph(view, out.with_name(f"{out.name}_after_loop.png"))


def photograph(view: ViewPage, path: Path) -> None:
    view.screenshot(path)
    shrink(path)


def shrink(path: Path) -> None:
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
