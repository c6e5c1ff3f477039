# SPDX-License-Identifier: Apache-2.0
"""Figures: how large the page is, and how soon it shows a value."""

import gzip
import pathlib

from common import busy, note

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "gateway/outputs/web/page"
SIZE_LIMIT = 90 * 1024
FIRST_VALUE_MS = 500


def test_first_value(context):
    browser = context.browser
    for view, selector in (("overview", ".data tbody td.num"), (f"device/{context.device}", ".point-rows .p-value")):
        times = []
        for _ in range(3):
            browser.open(view)
            times.append(browser.driver.execute_async_script("""
                const done = arguments[1], selector = arguments[0];
                const look = () => document.querySelector(selector)?.textContent ? done(window.firstValue ?? performance.now())
                  : requestAnimationFrame(look);
                look();""", selector))
        note(f"first value of {view.split('/')[0]}, ms", round(min(times)), FIRST_VALUE_MS)
        assert busy() or min(times) < FIRST_VALUE_MS, times
    return busy()


def test_size(context):
    files = [f for f in PAGE.rglob("*") if f.is_file()]
    size = sum(len(gzip.compress(f.read_bytes(), 9)) for f in files)
    note("page, gzip, bytes", size, SIZE_LIMIT)
    assert size < SIZE_LIMIT, size
