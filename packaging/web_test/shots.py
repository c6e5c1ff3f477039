#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes a picture of every view, light and dark, wide and narrow.

usage: shots.py URL FOLDER [--only NAME]
"""

import argparse
import pathlib
import time

from browser import Browser

FAVOURITES = ["panel.incomer.voltage_l1", "panel.incomer.active_power_sum", "bay-1.feeder-1.current_l2", "bay-1.feeder-2.current_l1",
              "io.ai-1.input_1", "bay-1.feeder-1.setting_group"]
# A script that is run in a view, after its words have come.
SCRIPTS = {
    "question": """[...document.querySelectorAll('.p-act button:not([hidden])')].find((b) => b.ariaLabel.includes('setting_group')).click();
                   document.getElementById('new-value').value = '1'; document.querySelector('.ask .strong').click();""",
    "menu": "document.getElementById('menu').click();",
    "communication": "document.querySelector('details.folded').open = true; document.querySelector('details.folded').scrollIntoView();",
    "cursor": """const over = document.querySelector('.plot .over'); const r = over.getBoundingClientRect();
                 over.dispatchEvent(new PointerEvent('pointermove', {clientX: r.left + r.width * 0.6, clientY: r.top + 60, bubbles: true}));""",
}
VIEWS = {
    "favourites": ("favourites", "voltage_l1"),
    "menu": ("overview", "Good values"),
    "question": ("device/bay-1.feeder-1", "setting_group"),
    "communication": ("device/bay-2.transformer-1", "Communication"),
    "cursor": ("trends?range=1h&points=panel.incomer.voltage_l1,panel.incomer.voltage_l2,panel.incomer.current_l1", "Maximum"),
    "empty": ("trends?from=1577934000000&until=1577937600000&points=panel.incomer.voltage_l1", "No values"),
    "line-lent": ("line/drives", "lent"),
    "overview": ("overview", "Good values"),
    "device": ("device/bay-1.feeder-1", "current_l1"),
    "device-silent": ("device/bay-1.feeder-2", "has never answered"),
    "line": ("line/bay-1", "Trace"),
    "alarms": ("alarms", "baudgate 0.1.0 has started"),
    "trends": ("trends?range=6h&points=io.ai-4.input_1,io.ai-4.input_2,panel.incomer.voltage_l1,panel.incomer.voltage_l2,"
               "panel.incomer.current_l1", "Maximum"),
    "points": ("points?q=voltage", "points have"),
    "writes": ("writes", "not sent"),
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
    browser.open("overview")
    browser.run("localStorage.setItem('favourites /', JSON.stringify(arguments[0])); localStorage.setItem('sets /', '{}')", FAVOURITES)
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
                if view.startswith("trends"):
                    browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots')?.dataset.drawn"))
                if name in SCRIPTS:
                    browser.run(SCRIPTS[name])
                time.sleep(0.5)  # the small curves come one after the other
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
