#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes a picture of every view, light and dark, wide and narrow.

usage: shots.py URL FOLDER [--only NAME]
"""

import argparse
import pathlib

from browser import Browser

VIEWS = {
    "overview": ("overview", "Good values"),
    "device": ("device/bay-1.feeder-1", "current_l1"),
    "device-silent": ("device/bay-1.feeder-2", "has never answered"),
    "line": ("line/bay-1", "Trace"),
    "alarms": ("alarms", "baudgate 0.1.0 has started"),
    "trends": ("trends?range=6h&points=io.ai-4.input_1,io.ai-4.input_2,panel.incomer.voltage_l1,panel.incomer.voltage_l2,"
               "panel.incomer.current_l1", "Maximum"),
    "points": ("points?q=voltage", "points have"),
    "system": ("system", "protocol:"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    browser = Browser(options.url)
    for name, (view, words) in VIEWS.items():
        if options.only and name != options.only:
            continue
        for scheme in ("light", "dark"):
            for width, height in ((1440, 900), (390, 844)):
                browser.colours(scheme)
                browser.size(width, height)
                browser.open(view)
                browser.wait_text(words)
                browser.wait("live", lambda: browser.text("#link") == "live")
                if name == "trends":
                    browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots')?.dataset.drawn"))
                wide = browser.run("return document.documentElement.scrollWidth")
                browser.screenshot(options.folder / f"{name}-{scheme}-{width}.png", whole=False)
                tall = min(4000, browser.run("return document.documentElement.scrollHeight"))
                browser.size(width, tall)
                browser.screenshot(options.folder / f"{name}-{scheme}-{width}-whole.png")
                print(name, scheme, width, f"{wide}x{tall}", "TOO WIDE" if wide > width else "", flush=True)
                for line in browser.complaints() + browser.run("return window.refusals"):
                    print("  ", line)
    browser.quit()


if __name__ == "__main__":
    main()
