# SPDX-License-Identifier: Apache-2.0
"""Details: zones of times, filters of events, sizes for fingers, words, and what is not known yet."""

import re
import urllib.request

from selenium.webdriver.common.keys import Keys

from browser import Browser
from common import live, open_view, views
from overview_tests import only_mock
from stage import TOKEN

FINGER = 44


def test_local_time_and_utc(context):
    browser = Browser(context.stage.url)
    try:
        browser.command("Emulation.setTimezoneOverride", timezoneId="Asia/Kathmandu")
        browser.open("alarms")
        browser.wait_text("Time (GMT+5:45)")
        first = lambda: browser.text("section[aria-label='Events'] td.time")
        local = browser.wait("an event", first)
        browser.run("const s = document.getElementById('zone'); s.value = 'utc'; s.dispatchEvent(new Event('change'))")
        browser.wait_text("Time (UTC)")
        utc = browser.wait("an event", first)
        minutes = lambda text: int(text[11:13]) * 60 + int(text[14:16])
        assert (minutes(local) - minutes(utc)) % 1440 == 345, (local, utc)
        assert "All times are UTC" in browser.text("footer")
        browser.open("system")
        browser.wait_text("Clock of the gateway (UTC)")
    finally:
        browser.quit()


def test_events_are_filtered_and_exported(context):
    only_mock(context)
    browser = context.browser
    open_view(context, "alarms", " events")
    choose = lambda label, value: browser.run(
        "const s = [...document.querySelectorAll('.field')].find((f) => f.textContent.startsWith(arguments[0])).querySelector('select');"
        "s.value = arguments[1]; s.dispatchEvent(new Event('change'))", label, value)
    choose("Kind", "message")
    browser.find("#event-text").send_keys("has STARTED")
    rows = lambda: browser.texts("section[aria-label='Events'] tbody td.said")
    browser.wait("starts only", lambda: rows() and all("has started" in row for row in rows()))
    browser.wait("an address", lambda: "kind=message" in browser.driver.current_url and "text=has" in browser.driver.current_url)
    link = browser.find("section[aria-label='Events'] a[download]").get_attribute("href")
    with urllib.request.urlopen(link) as answer:
        lines = answer.read().decode().splitlines()
    assert lines[0].startswith("seq,") and lines[0].endswith(",priority,text") and len(lines) > 10 and all("has started" in line for line in lines[1:]), lines[:3]
    browser.open("alarms")
    browser.wait_text(" events")
    choose("Priority", "high")
    browser.wait("trips only", lambda: rows() and all("tripped" in row for row in rows()))
    assert "priority=high" in browser.driver.current_url


def test_targets_are_large_enough_for_fingers(context):
    browser = context.browser
    try:
        browser.size(390, 844)
        for view, words in views(context).items():
            open_view(context, view, words)
            small = browser.run("""return [...document.querySelectorAll('button, select, a.button, summary, input:not([type=checkbox])')]
                .filter((e) => e.checkVisibility()).map((e) => [e.textContent.slice(0, 20) || e.id, e.getBoundingClientRect()])
                .filter(([, r]) => r.height && (r.height < arguments[0] || r.width < arguments[0])).map(([t, r]) => `${t} ${r.width}x${r.height}`)""",
                                FINGER)
            assert not small, (view, small)
    finally:
        browser.size(1440, 900)


def test_login_says_where_the_token_comes_from(context):
    stage = context.new_stage(token=TOKEN)
    browser = Browser(stage.url)
    try:
        browser.open("overview")
        browser.wait_text("Log in")
        assert "web.token" in browser.text() and "baudgate" not in browser.text("#alarm-bar")
        assert "first line of the file" in browser.text(), browser.text()
    finally:
        browser.quit()
        stage.end()


def test_login_of_users(context):
    only_mock(context)
    stage = context.new_stage(token=TOKEN, role="operator")
    browser = Browser(stage.url)
    try:
        browser.open("overview")
        browser.wait_text("baudgate users add")
        browser.find("#user").send_keys("anna")
        browser.find("#token").send_keys(TOKEN, Keys.ENTER)
        browser.wait_text("anna, operator", "#who")
        browser.find("#logout").click()
        browser.wait_text("baudgate users add")
        assert not browser.text("#who")
    finally:
        browser.quit()
        stage.end()


def test_one_error_once(context):
    browser = context.browser
    browser.open("device/bay-1.no-such")
    browser.wait_text("no-such", ".problem")
    live(browser)
    said = [p for p in browser.texts("main .problem")]
    assert len(said) == 1 and len(said[0].splitlines()) == 1, said
    assert not [p for p in browser.all(".point-box") if p.is_displayed()]


def test_words_in_place_of_identifiers(context):
    browser = context.browser
    for view, words in views(context).items():
        open_view(context, view, words)
        browser.run("document.querySelectorAll('details.folded').forEach((part) => { part.open = true; })")
        found = re.findall(r"no_reply|line_down|not_sent|\d\d\d\d-\d\d-\d\dT", browser.text())
        assert not found, (view, found)
    browser.run("document.querySelectorAll('details.folded').forEach((part) => { part.open = false; })")


def test_use_is_a_dash_until_a_minute_is_known(context):
    only_mock(context)
    stage = context.new_stage(uptime=5)
    browser = Browser(stage.url)
    try:
        browser.open("overview")
        browser.wait_text("Devices that work")
        use = browser.wait("a line", lambda: browser.texts("section[aria-label='Lines'] td[data-title='Use']"))
        assert set(use) == {"–"}, use
        browser.open("line/bay-1")
        browser.wait_text("Trace")
        browser.run("document.querySelector('details.folded').open = true")
        idle = browser.wait("the last minute", lambda: browser.texts("section[aria-label='Use of the wire in the last minute'] .bar-text"))
        assert set(idle) == {"–"}, idle
    finally:
        browser.quit()
        stage.end()
