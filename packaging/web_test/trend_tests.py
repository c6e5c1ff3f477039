# SPDX-License-Identifier: Apache-2.0
"""Trends."""

import re
import time
import urllib.parse
import urllib.request

from selenium.webdriver.common.action_chains import ActionChains

from common import busy, note, open_view, trends
from stage import LeftOut, Mock

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


def address_of(browser):
    return urllib.parse.parse_qs(browser.driver.current_url.split("?")[1])


def test_zoom_keeps_the_right_end_and_back_undoes_it(context):
    browser = context.browser
    open_view(context, trends(context, "1h"), "Maximum")
    browser.find("button[aria-label='Zoom in']").click()
    browser.wait("half an hour", lambda: address_of(browser).get("range") == ["1800000"])
    browser.wait_text("moves with the time")
    browser.driver.back()
    browser.wait("an hour again", lambda: address_of(browser).get("range") == ["1h"])
    browser.wait_text("(60 min), moves with the time")
    browser.find("button[data-range='15m']").click()
    browser.wait_text("(15 min), moves")
    browser.find("button[aria-label='Earlier']").click()
    browser.wait("a span in the address", lambda: "until" in address_of(browser))
    until = int(address_of(browser)["until"][0])
    assert until < time.time() * 1000 - 400e3, until


def test_time_picker_and_an_empty_range(context):
    browser = context.browser
    open_view(context, trends(context, "1h"), "Maximum")
    browser.find(".menu summary").click()
    browser.wait("the times of now", lambda: browser.find("#until").get_attribute("value"))
    for name, value in (("from", "2020-01-02T03:00:00"), ("until", "2020-01-02T04:00:00")):
        browser.run("document.getElementById(arguments[0]).value = arguments[1]", name, value)
    browser.find(".menu button[type='submit']").click()
    browser.wait_text("2020-01-02 03:00:00 to 2020-01-02 04:00:00")
    browser.wait_text("No values from 2020-01-02 03:00:00")
    assert not [c for c in browser.all(".plot canvas") if c.is_displayed()], "an axis of nothing"
    browser.find(".menu summary").click()
    [b for b in browser.all(".menu button") if b.text == "Yesterday"][0].click()
    browser.wait_text("00:00:00 UTC (24 h)")


def test_values_with_texts_have_no_mean(context):
    if context.kind is not Mock:
        raise LeftOut("the samples have such a point")
    browser = context.browser
    open_view(context, "trends?range=1h&points=bay-1.feeder-1.module_status,panel.incomer.frequency", "Maximum")
    cells = lambda point: browser.wait(point, lambda: [[c.text for c in r.find_elements("css selector", "td")]
                                                       for r in browser.all(".trend-table tbody tr") if point in r.text])[0]
    titles = browser.texts(".trend-table th")
    mean = titles.index("Mean")
    browser.wait("values", lambda: cells("frequency")[mean] != "–")
    assert cells("module_status")[mean] == "–", cells("module_status")
    assert re.match(r"\d+\.\d\d$", cells("frequency")[mean]), cells("frequency")


def test_panels_cursor_and_csv(context):
    browser = context.browser
    open_view(context, trends(context, "1h"), "Maximum")
    units = len(browser.wait("a panel for each unit", lambda: browser.all(".plot-figure")))
    browser.find("input[type='checkbox']").click()
    browser.wait("a panel for each curve", lambda: len(browser.all(".plot-figure")) == len(context.trends) > units)
    assert "panels=curve" in browser.driver.current_url
    plot = browser.find(".plot")
    ActionChains(browser.driver).move_to_element(plot).perform()
    tip = browser.wait("a tooltip", lambda: browser.text(".tip"))
    assert context.trends[0] in tip and re.search(r"20\d\d-\d\d-\d\d", tip), tip
    link = browser.find("a.button[download]").get_attribute("href")
    asked = urllib.parse.parse_qs(link.split("?")[1])["point"]
    assert asked == [",".join(context.trends)], asked
    if context.kind is Mock:
        with urllib.request.urlopen(link) as answer:
            text = answer.read().decode()
        assert all(name in text for name in context.trends), text[:300]
    browser.find("input[type='checkbox']").click()


def test_a_named_set_is_in_the_address(context):
    browser = context.browser
    open_view(context, trends(context, "1h"), "Maximum")
    browser.find("#set-name").send_keys("Feeders & co\n")
    browser.wait_text("Trends: Feeders & co")
    link = browser.driver.current_url
    browser.open("overview")
    browser.wait_text("Devices")
    browser.driver.get(link)
    browser.wait_text("Trends: Feeders & co")
    browser.wait("its points", lambda: browser.texts(".trend-table td.name") == context.trends)
    [b for b in browser.all("button") if b.text == "Delete this set"][0].click()
    browser.wait("no set", lambda: "set=" not in browser.driver.current_url)


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
