# SPDX-License-Identifier: Apache-2.0
"""What happens while the page is open: values, deaths, alarms, a gateway that is gone."""

import json
import re
import time
import urllib.parse
import urllib.request

from browser import Browser
from common import live, note, open_view, views


def get(stage, name, **query):
    with urllib.request.urlopen(f"{stage.url}/api/v1/{name}?{urllib.parse.urlencode(query)}") as answer:
        return json.load(answer)


def unfold(context):
    """Opens the part of a device's page that is folded, and keeps it open."""
    summary = context.browser.wait("it", lambda: context.browser.all("details.folded summary"))[0]
    if not context.browser.run("return arguments[0].parentNode.open", summary):
        summary.click()


def test_value_changes(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    values = lambda: browser.texts(".point-rows .p-value")[:4]
    first = browser.wait("values", lambda: any(re.search(r"\d", v) for v in values()) and values())
    browser.wait("another value", lambda: values() != first)


def test_ages_count_on(context):
    browser = context.browser
    context.stage.kill()
    open_view(context, f"device/{context.stage.victim}", "Values")
    age = lambda: float(re.match(r"[0-9.]+", browser.text(".point-rows .p-age") or "0").group())
    first = browser.wait("an age", lambda: age() > 1 and age())
    browser.wait("a higher one", lambda: age() > first + 1)


def test_killed_device_turns_grey_with_the_sentence_of_the_status(context):
    browser = context.browser
    stage = context.new_stage()
    browser.url = stage.url
    try:
        open_view(context, f"device/{stage.victim}", "online")
        browser.wait("a good value", lambda: browser.all(".point-rows .point-row.good"))
        stage.kill()
        browser.wait("grey rows", lambda: not browser.all(".point-rows .point-row.good"), 20)
        browser.wait_text("bad: communication failure")
        says = lambda: get(stage, "status", target=stage.victim)["lines"][0]["devices"][0]["advice"]
        words = lambda text: re.sub(r"[\d.,]+", "#", text)
        sentence = browser.wait("a sentence", says)[0]
        browser.wait("the same on the page", lambda: words(sentence) in words(browser.text()))
        browser.go("overview")
        row = browser.wait("it among the first", lambda: [r for r in browser.all(".rank-bad, .rank-warn") if stage.victim in r.text])[0]
        assert "offline" in row.text, row.text
        cause = sentence.split(". ")[0].split(": ", 1)[1]
        browser.wait("its cause on the overview", lambda: words(cause) in words(browser.text(".problems")))
    finally:
        browser.url = context.stage.url
        stage.end()


def test_device_is_not_online_over_bad_points_after_a_stop(context):
    """The gateway was stopped, and its device died meanwhile: the page asks on as before."""
    stage = context.new_stage()
    browser = Browser(stage.url)
    try:
        browser.open(f"device/{stage.victim}")
        browser.wait_text(f"{stage.victim}: online")
        live(browser)
        stage.hang()
        stage.kill()
        browser.wait_text("Connection to the gateway lost", "#lost", 10)
        live(browser)
        browser.wait("bad points", lambda: not browser.all(".point-rows .point-row.good"), 20)
        browser.wait_text(f"{stage.victim}: offline", seconds=15)
    finally:
        browser.quit()
        stage.end()


def test_devices_behind_a_closed_port_show_why(context):
    browser = context.browser
    open_view(context, "overview", "Line spare")
    rows = browser.wait("their row", lambda: [r for r in browser.all(".problems tbody tr") if "Line spare" in r.text])
    assert "port closed" in rows[0].text and "away with it" in rows[0].text, rows[0].text
    assert not [r for r in browser.texts(".problems tbody tr") if "spare.ai-9" in r], "one cause, two rows"
    browser.go("device/spare.ai-9")
    browser.wait_text("port closed")


def test_exchanges_are_decoded_frames(context):
    browser = context.browser
    line, _, _ = context.device.partition(".")
    for view in (f"device/{context.device}", f"line/{line}"):
        browser.open(view)
        if view.startswith("device"):
            unfold(context)
        browser.wait_text("ok, ")
        means = browser.wait("what they mean", lambda: browser.texts("td.means"))
        assert re.search(r"^\w+ \S", means[0]), means[0]
    browser.find("main p.controls button[aria-pressed]").click()
    browser.wait_text("Live.")
    browser.wait("live frames", lambda: browser.texts("td.means"))


def test_alarm_on_every_view_and_acknowledged(context):
    browser = context.browser
    stage = context.new_stage()
    browser.url = stage.url
    try:
        open_view(context, "overview", "Devices")
        text = stage.alarm()
        browser.wait_text(text, "#alarm-bar", 30)
        for view, words in views(context).items():
            browser.go(view)
            browser.wait_text(words)
            assert text in browser.text("#alarm-bar"), view
        assert not browser.all("img"), "a text was read as HTML"
        browser.go("alarms")
        browser.wait_text(text)
        left = lambda: len(browser.all("main .action button:not([hidden])"))
        before = browser.wait("alarms to acknowledge", left)
        browser.find("#alarm-bar button").click()
        browser.wait("acknowledged", lambda: text not in browser.text("#alarm-bar"))
        browser.wait("who has acknowledged it", lambda: [r for r in browser.all(".alarm-seen") if text in r.text])
        browser.wait("one less", lambda: left() < before)
        if left():
            before = left()
            browser.find("main .action button:not([hidden])").click()
            browser.wait("one less", lambda: left() < before)
    finally:
        browser.url = context.stage.url
        stage.end()


def test_lost_connection_is_said_and_comes_back(context):
    stage = context.new_stage()
    browser = Browser(stage.url)
    try:
        browser.open("overview")
        browser.wait_text("Devices")
        live(browser)
        stage.hang()
        begin = time.time()
        browser.wait_text("Connection to the gateway lost", "#lost", 10)
        silent = time.time() - begin
        live(browser)
        stage.stop()
        begin = time.time()
        browser.wait_text("Connection to the gateway lost", "#lost", 10)
        stopped = time.time() - begin
        note("a stream without a word is said after, s", round(silent, 2), 3.3)
        note("a server that is gone is said after, s", round(stopped, 2), 3.3)
        grey = browser.run("return getComputedStyle(document.querySelector('main')).filter")
        assert "grayscale" in grey, grey
        time_text = browser.text("#lost")
        browser.wait("an age that counts on", lambda: browser.text("#lost") != time_text)
        stage.start()
        live(browser)
        browser.wait("not grey", lambda: browser.run("return getComputedStyle(document.querySelector('main')).filter") == "none")
        assert not browser.find("#lost").is_displayed()
        stage.reload()
        live(browser)
        browser.go(f"device/{context.device}")
        browser.wait_text("good")
        assert silent < 3.3 and stopped < 3.3, (silent, stopped)
    finally:
        browser.quit()
        stage.end()


def test_stream_is_closed_while_hidden(context):
    browser, stage = context.browser, context.stage
    open_view(context, "overview", "Devices")
    viewers = stage.viewers
    assert viewers() >= 1
    hide = """Object.defineProperty(document, 'hidden', {configurable: true, value: arguments[0]});
              document.dispatchEvent(new Event('visibilitychange'))"""
    browser.run(hide, True)
    browser.wait("no stream", lambda: viewers() == 0)
    browser.run(hide, False)
    browser.wait("one stream", lambda: viewers() == 1)
    live(browser)
