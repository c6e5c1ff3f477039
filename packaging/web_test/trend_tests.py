# SPDX-License-Identifier: Apache-2.0
"""Trends."""

import urllib.parse

from selenium.webdriver.common.action_chains import ActionChains

from common import busy, note, open_view, trends
from stage import LeftOut

YEAR_MS = 300


def test_trend_zoom(context):
    browser = context.browser
    open_view(context, trends(context, "6h"), "Maximum")
    drawn = lambda: int(browser.run("return document.querySelector('.plots')?.dataset.drawn ?? 0"))
    browser.wait("a chart", drawn)
    before = drawn()
    box = browser.find(".plot")
    browser.run("arguments[0].scrollIntoView({block: 'center'})", box)
    ActionChains(browser.driver).move_to_element_with_offset(box, -200, 0).click_and_hold() \
        .move_by_offset(100, 0).move_by_offset(200, 0).release().perform()
    browser.wait("a span in the address", lambda: "from=" in browser.driver.current_url)
    browser.wait("drawn anew", lambda: drawn() > before)
    address = urllib.parse.parse_qs(browser.driver.current_url.split("?")[1])
    span = int(address["until"][0]) - int(address["from"][0])
    assert 600e3 < span < 6 * 3600e3, span
    before = drawn()
    browser.find("button[aria-label='Zoom out']").click()
    browser.wait("drawn anew", lambda: drawn() > before)
    browser.find("button[data-range='1h']").click()
    browser.wait("moves with the time", lambda: "range=1h" in browser.driver.current_url)


def test_trend_of_a_point_that_is_not_kept(context):
    browser, point = context.browser, context.stage.unkept
    if not point:
        raise LeftOut("nobody knows which points are not kept")
    open_view(context, f"trends?points={point}", point)
    browser.wait_text("not recorded")
    browser.find(f"button[aria-label='Remove {point}']").click()
    browser.wait_text("No points are chosen")


def test_a_year_is_drawn_fast(context):
    browser = context.browser
    open_view(context, trends(context, "1h"), "Maximum")
    browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots').dataset.drawn"))
    worst = 0
    for _ in range(3):
        before = int(browser.run("return document.querySelector('.plots').dataset.drawn"))
        browser.run("""window.longTasks.length = 0; document.querySelector("button[data-range='365d']").click()""")
        browser.wait("drawn", lambda: int(browser.run("return document.querySelector('.plots').dataset.drawn")) > before)
        time_ms = float(browser.run("return document.querySelector('.plots').dataset.drawMs"))
        time_ms = max([time_ms] + [ms for _, ms in browser.run("return window.longTasks")])
        worst = max(worst, time_ms)
        browser.find("button[data-range='1h']").click()
    note("a year of four points drawn, ms", worst, YEAR_MS)
    assert busy() or worst < YEAR_MS, worst
    return busy()
