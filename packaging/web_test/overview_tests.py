# SPDX-License-Identifier: Apache-2.0
"""The first view and the alarm bar: one list of problems, worst first; and who is named by the bar's button."""

import json
import urllib.request

from selenium.webdriver.common.action_chains import ActionChains

from browser import Browser
from common import live, open_view
from stage import LeftOut, Mock


def asked(stage):
    """The requests that act, as the mock server got them."""
    with urllib.request.urlopen(stage.url + "/mock/asked") as answer:
        return json.load(answer)


def only_mock(context):
    if context.kind is not Mock:
        raise LeftOut("only the samples have all kinds of problems")


def test_problems_worst_first_and_each_cause_once(context):
    only_mock(context)
    browser = context.browser
    open_view(context, "overview", "In maintenance")
    rows = browser.wait("problems with alarms", lambda: [r for r in browser.texts(".problems tbody tr") if "tripped" in r] and
                        browser.texts(".problems tbody tr"))
    scale = ["high", "medium", "low", "hint"]
    over = [n for n, r in enumerate(rows) if "over, not acknowledged" in r]
    ranks = [scale.index(r.split()[0]) for n, r in enumerate(rows) if n not in over]
    assert ranks == sorted(ranks) and "tripped" in rows[0], rows
    assert over and all(r.split()[0] == "hint" for n, r in enumerate(rows) if n > over[0] and n not in over), rows
    assert browser.text().count("no such port") == 1, rows
    port = next(r for r in rows if "no such port" in r)
    assert "ai-9 and ai-10 are away with it" in port and "plug the adapter in" in port, port
    assert len([r for r in rows if "input_3" in r]) == 1, rows
    assert not [r for r in rows if "ai-3" in r or "pump" in r], "what is in maintenance is no failure"
    kept = browser.text("section[aria-label='In maintenance']")
    assert "io.ai-3" in kept and "Line drives" in kept and "lent" in kept, kept
    assert "3 in maintenance" in browser.text("h1"), browser.text("h1")
    assert len(browser.all("section[aria-label='Lines'] tbody tr")) == 6, "lines without a device that works are in the list"


def test_menu_and_bar_take_a_line_each_on_a_phone(context):
    browser = context.browser
    try:
        browser.size(390, 844)
        open_view(context, "overview", "Devices")
        browser.wait("the bar", lambda: browser.find("#alarm-bar").is_displayed())
        heights = [browser.run("return document.querySelector(arguments[0]).offsetHeight", one) for one in (".bar", "#alarm-bar")]
        assert max(heights) <= 56, heights
        assert not browser.find("#query").is_displayed()
        browser.find("#menu").click()
        assert browser.find("#query").is_displayed()
        browser.find("#views a[href='#/system']").click()
        browser.wait_text("Configuration in force")
        assert not browser.find("#query").is_displayed()
    finally:
        browser.size(1440, 900)


def test_bar_acknowledges_the_alarm_that_it_showed_when_pressed(context):
    only_mock(context)
    stage = context.new_stage()
    browser = Browser(stage.url)
    try:
        browser.open("overview")
        browser.wait_text("stage I> tripped", "#alarm-bar")
        live(browser)
        button = browser.find("#alarm-bar button")
        ActionChains(browser.driver).click_and_hold(button).perform()
        text = stage.alarm()
        browser.wait_text(text, "#alarm-bar")
        ActionChains(browser.driver).release().perform()
        browser.wait("a request", lambda: asked(stage))
        with urllib.request.urlopen(stage.url + "/api/v1/alarms") as answer:
            seen = [a["text"] for a in json.load(answer)["records"] if not a["unacknowledged"]]
        assert "stage I> tripped" in seen and text not in seen, seen
    finally:
        browser.quit()
        stage.end()


def test_title_and_icon_have_the_number_of_alarms(context):
    only_mock(context)
    stage = context.new_stage()
    browser = Browser(stage.url)
    try:
        browser.open("system")
        browser.wait_text("to acknowledge", "#alarm-bar")
        assert browser.driver.title.startswith("(6) System"), browser.driver.title
        icon = lambda: browser.find("#icon").get_attribute("href")
        assert icon().endswith("favicon-6.svg"), icon()
        stage.alarm()
        browser.wait("one more", lambda: browser.driver.title.startswith("(7) "))
        assert icon().endswith("favicon-7.svg"), icon()
        with urllib.request.urlopen(icon()) as answer:
            assert answer.status == 200
    finally:
        browser.quit()
        stage.end()


def test_alarms_of_the_gateway_itself_without_events(context):
    only_mock(context)
    stage = context.new_stage(events=False)
    browser = Browser(stage.url)
    try:
        browser.open("alarms")
        browser.wait_text("port down")
        browser.wait_text("records no events")
        for source, place in (("127.0.0.1:1", "at=routes"), ("spare", "#/line/spare")):
            link = [a for a in browser.all("main td a") if a.text == source][0]
            assert place in link.get_attribute("href"), link.get_attribute("href")
        browser.go("system?at=routes")
        browser.wait("the routes in view", lambda: browser.run(
            "const r = document.querySelector(\"section[aria-label='Routes']\")?.getBoundingClientRect();"
            "return r && r.top >= 0 && r.top < innerHeight"))
    finally:
        browser.quit()
        stage.end()
