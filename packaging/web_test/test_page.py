#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of the page in a browser, against the mock server or, with --url, against a running gateway.

usage: test_page.py [--url URL] [--device LINE.DEVICE] [--axe axe.min.js] [--only WORD]

With --url the tests that need the mock (a device that is killed, an alarm that is raised, 10,000 points, a restart) are left out.
"""

import argparse
import gzip
import json
import os
import pathlib
import re
import socket
import subprocess
import sys
import time
import traceback
import urllib.parse
import urllib.request

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from browser import Browser

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "gateway/web/page"
DYGRAPHS = pathlib.Path("/usr/share/javascript/dygraphs")
SIZE_LIMIT = 90 * 1024
LONG_TASK_MS = 50
FIRST_VALUE_MS = 500
YEAR_MS = 300
TRENDS = "trends?range={}&points=io.ai-4.input_1,io.ai-4.input_2,panel.incomer.voltage_l1,panel.incomer.current_l1"

# Scrolls the table of points for five seconds; gives back the frames and the durations of long tasks.
SCROLL = """
const done = arguments[0], box = document.querySelector('.point-box');
window.longTasks.length = 0;
let frames = 0;
const begin = performance.now();
const step = () => {
  ++frames;
  box.scrollTop = (box.scrollTop + 371) % (box.scrollHeight - box.clientHeight);
  if (performance.now() - begin < 5000) requestAnimationFrame(step);
  else setTimeout(() => done([frames, window.longTasks.map(([at, ms]) => ms)]), 200);
};
requestAnimationFrame(step);
"""

numbers = []


def note(name, value, limit):
    numbers.append((name, value, limit))


class Mock:
    """The mock server as a process of its own."""

    def __init__(self, *options, port=0):
        if not port:
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", 0))
                port = probe.getsockname()[1]
        self.port, self.options, self.url = port, options, f"http://127.0.0.1:{port}"
        self.start()

    def start(self):
        self.process = subprocess.Popen([sys.executable, HERE / "mock.py", "--port", str(self.port), *self.options],
                                        stdout=subprocess.PIPE)
        self.process.stdout.readline()

    def stop(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def post(self, path, **query):
        address = f"{self.url}{path}?{urllib.parse.urlencode(query)}"
        urllib.request.urlopen(urllib.request.Request(address, data=b"", method="POST")).close()

    def get(self, path):
        with urllib.request.urlopen(self.url + path) as answer:
            return json.load(answer)


def views(context):
    line, _, _ = context.device.partition(".")
    return {"overview": "Devices", f"device/{context.device}": "Round trips", f"line/{line}": "Who used the wire",
            "alarms": "Events", "trends": "Add a point", "points": "points;", "system": "Configuration in force"}


def live(browser):
    browser.wait("live", lambda: browser.text("#link") == "live")


def open_view(context, view, words):
    context.browser.open(view)
    context.browser.wait_text(words)
    live(context.browser)


def test_value_changes(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    values = lambda: [e.text for e in browser.all(".point-rows .p-value")[:4]]
    first = browser.wait("values", lambda: any(re.search(r"\d", v) for v in values()) and values())
    browser.wait("another value", lambda: values() != first)


def test_ages_count_on(context):
    browser = context.browser
    open_view(context, "device/bay-1.feeder-2" if context.mock else f"device/{context.device}", "Answered")
    context.mock and context.mock.post("/mock/kill", device="panel.meter-2")
    browser.go("device/panel.meter-2" if context.mock else f"device/{context.device}")
    age = lambda: browser.text(".point-rows .p-age")
    if context.mock:
        for words in ("2.", "4."):
            browser.wait(f"an age of {words}", lambda: age().startswith(words))


def test_killed_device_turns_grey(context):
    browser, mock = context.browser, context.mock
    open_view(context, "device/panel.meter-5", "online")
    browser.wait("a good value", lambda: browser.all(".point-rows .point-row.good"))
    mock.post("/mock/kill", device="panel.meter-5")
    browser.wait("grey rows", lambda: not browser.all(".point-rows .point-row.good"), 5)
    browser.wait_text("bad: communication failure")
    browser.wait_text("not a byte came: check its power")
    browser.go("overview")
    row = browser.wait("the device among the first", lambda: [r for r in browser.all(".rank-bad") if "panel.meter-5" in r.text])
    assert "offline" in row[0].text, row[0].text


def test_alarm_on_every_view_and_acknowledged(context):
    browser, mock = context.browser, context.mock
    open_view(context, "overview", "Devices")
    text = "breaker <img src=x onerror=alert(1)> tripped"
    mock.post("/mock/alarm", device="bay-2.feeder-11", text=text)
    browser.wait_text(text, "#alarm-bar", 5)
    for view, words in views(context).items():
        browser.go(view)
        browser.wait_text(words)
        assert text in browser.text("#alarm-bar"), view
    assert not browser.all("img"), "a text was read as HTML"
    browser.go("alarms")
    browser.wait_text(text)
    browser.find("#alarm-bar button").click()
    browser.wait("acknowledged", lambda: text not in browser.text("#alarm-bar"))
    browser.wait("who has acknowledged it", lambda: [r for r in browser.all(".alarm-seen") if text in r.text])
    left = len(browser.all("main .action button:not([hidden])"))
    browser.find("main .action button:not([hidden])").click()
    browser.wait("one less", lambda: len(browser.all("main .action button:not([hidden])")) < left)


def test_trend_zoom(context):
    browser = context.browser
    open_view(context, TRENDS.format("6h"), "Maximum")
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
    browser.wait("follows the time", lambda: "range=1h" in browser.driver.current_url)


def test_trend_of_a_point_that_is_not_kept(context):
    browser = context.browser
    open_view(context, "trends?points=bay-1.feeder-1.none", "none")
    browser.wait_text("are not kept")
    browser.find("button[aria-label='Remove bay-1.feeder-1.none']").click()
    browser.wait_text("No points are chosen")


def test_a_year_is_drawn_fast(context):
    browser = context.browser
    open_view(context, TRENDS.format("1h"), "Maximum")
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
    assert worst < YEAR_MS, worst


def test_search_in_10000_points(context):
    mock = Mock("--points", "10000")
    browser = Browser(mock.url)
    try:
        browser.open("overview")
        browser.wait_text("Devices")
        live(browser)
        # The first fetch of the points is a request of 2 MB; from then on nothing may take long.
        browser.find("#query").send_keys("voltage")
        browser.wait_text("points have")
        assert re.search(r"of 1\d,\d{3} points have", browser.text()), browser.text()[:200]
        note("longest task of the first search (10,000 points are fetched), ms",
             max((ms for _, ms in browser.run("return window.longTasks")), default=0), None)
        browser.find("#query").clear()
        browser.find("#query").send_keys("f")
        browser.wait_text("“f”")
        browser.run("window.longTasks.length = 0; window.typed = performance.now()")
        browser.find("#query").send_keys("eeder-1 current")
        browser.wait_text("“feeder-1 current”")
        browser.find("#query").clear()
        browser.find("#query").send_keys(Keys.BACKSPACE)
        browser.run("location.hash = '#/points'")
        browser.wait_text("10,")
        tasks = browser.run("return window.longTasks.filter(([at]) => at > window.typed)")
        note("longest task while searching 10,000 points, ms", max([t[1] for t in tasks], default=0), LONG_TASK_MS)
        typing = tasks
        browser.wait("virtual rows", lambda: browser.all(".virtual .point-rows .point-row"))
        rows = len(browser.all(".point-rows .point-row"))
        assert rows < 120, rows
        # Compilers on the same cores make tasks long that are not: the best of three rounds counts.
        rounds = []
        while len(rounds) < 3 and not (rounds and not rounds[-1][1]):
            rounds.append(browser.driver.execute_async_script(SCROLL))
        frames, tasks = min(rounds, key=lambda r: max(r[1], default=0))
        note("longest task in 5 s of scrolling 10,000 rows, ms", max(tasks, default=0), LONG_TASK_MS)
        note("frames in 5 s of scrolling", frames, None)
        if (tasks or typing) and os.getloadavg()[0] > os.cpu_count():
            return f"long tasks are not judged: the load of the machine is {os.getloadavg()[0]:.1f}"
        assert not tasks, rounds
        assert not typing, typing
        return None
    finally:
        browser.quit()
        mock.stop()


def test_lost_connection_is_said_and_comes_back(context):
    mock = Mock()
    browser = Browser(mock.url)
    try:
        browser.open("overview")
        browser.wait_text("Devices")
        live(browser)
        mock.post("/mock/hang")
        begin = time.time()
        browser.wait_text("Connection to the gateway lost", "#lost", 10)
        silent = time.time() - begin
        live(browser)
        mock.stop()
        begin = time.time()
        browser.wait_text("Connection to the gateway lost", "#lost", 10)
        stopped = time.time() - begin
        note("a stream without a word is said after, s", round(silent, 2), 3.3)
        note("a server that is gone is said after, s", round(stopped, 2), 3.3)
        grey = browser.run("return getComputedStyle(document.querySelector('main')).filter")
        assert "grayscale" in grey, grey
        time_text = browser.text("#lost")
        browser.wait("an age that counts on", lambda: browser.text("#lost") != time_text)
        mock.start()
        live(browser)
        browser.wait("not grey", lambda: browser.run("return getComputedStyle(document.querySelector('main')).filter") == "none")
        assert not browser.find("#lost").is_displayed()
        mock.post("/mock/reload")
        live(browser)
        browser.go("device/bay-1.feeder-1")
        browser.wait_text("good")
        assert silent < 3.3 and stopped < 3.3, (silent, stopped)
    finally:
        browser.quit()
        mock.stop()


def test_stream_is_closed_while_hidden(context):
    browser, mock = context.browser, context.mock
    open_view(context, "overview", "Devices")
    viewers = lambda: mock.get("/mock/viewers")["viewers"]
    assert viewers() >= 1
    hide = """Object.defineProperty(document, 'hidden', {configurable: true, value: arguments[0]});
              document.dispatchEvent(new Event('visibilitychange'))"""
    browser.run(hide, True)
    browser.wait("no stream", lambda: viewers() == 0)
    browser.run(hide, False)
    browser.wait("one stream", lambda: viewers() == 1)
    live(browser)


def test_dark_and_light(context):
    browser = context.browser
    open_view(context, "overview", "Devices")
    back = lambda: browser.run("return getComputedStyle(document.body).backgroundColor")
    browser.colours("light")
    light = back()
    browser.colours("dark")
    browser.wait("a dark page", lambda: back() != light)
    browser.run("const s = document.getElementById('theme'); s.value = 'light'; s.dispatchEvent(new Event('change'))")
    assert back() == light
    browser.run("const s = document.getElementById('theme'); s.value = 'auto'; s.dispatchEvent(new Event('change'))")
    assert back() != light
    browser.colours("light")
    browser.wait("a light page", lambda: back() == light)


def test_every_width(context):
    browser = context.browser
    try:
        for width, height in ((360, 740), (1024, 768), (3840, 2160)):
            browser.size(width, height)
            for view, words in views(context).items():
                open_view(context, view, words)
                wide = browser.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
                assert wide <= 0, (view, width, wide)
    finally:
        browser.size(1440, 900)


def test_no_complaint_of_the_browser(context):
    browser = context.browser
    browser.complaints()
    for view, words in views(context).items():
        open_view(context, view, words)
        refusals = browser.run("return window.refusals")
        assert not refusals, (view, refusals)
    open_view(context, TRENDS.format("1h") if context.mock else "trends", "Add a point")
    if context.mock:
        browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots').dataset.drawn"))
    assert not browser.run("return window.refusals"), browser.run("return window.refusals")
    complaints = browser.complaints()
    assert not complaints, complaints


def test_axe(context):
    if not context.axe:
        return "no --axe"
    browser = context.browser
    source = context.axe.read_text()
    violations = []
    for scheme in ("light", "dark"):
        browser.colours(scheme)
        for width in (1440, 360):
            browser.size(width, 900)
            for view, words in views(context).items():
                open_view(context, TRENDS.format("1h") if view == "trends" and context.mock else view, words)
                if view == "trends" and context.mock:
                    browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots').dataset.drawn"))
                violations += [(view, scheme, width, one) for one in browser.axe(source)]
    browser.colours("light")
    browser.size(1440, 900)
    assert not violations, violations
    return None


def test_a_found_point_leads_to_its_row(context):
    browser = context.browser
    open_view(context, "points?q=" + context.device, "points have")
    last = browser.wait("rows", lambda: browser.all(".point-rows .point-row:nth-child(20) .p-name a"))[0]
    name = last.text.rsplit(".", 1)[1]
    last.send_keys(Keys.ENTER)
    row = browser.wait("a marked row", lambda: browser.all(".point-row[aria-current]"))[0]
    assert name in row.text, (name, row.text)
    assert 0 < browser.run("return arguments[0].getBoundingClientRect().top", row) < 900


def test_keyboard(context):
    browser = context.browser
    open_view(context, "overview", "Devices")
    active = lambda: browser.run("return document.activeElement.id || document.activeElement.tagName")
    keys = lambda *what: ActionChains(browser.driver).send_keys(*what).perform()
    keys(Keys.TAB)
    assert active() == "skip", active()
    keys(Keys.ENTER)
    assert active() == "main", active()
    keys("/")
    assert active() == "query", active()
    keys("current")
    browser.wait_text("points have")
    assert active() == "query", active()
    keys(Keys.ESCAPE)
    browser.wait("where it was", lambda: browser.driver.current_url.endswith("#/overview"))
    browser.find("#views a[href='#/system']").send_keys(Keys.ENTER)
    browser.wait("the headline has the focus", lambda: active() == "H1")


def test_login(context):
    mock = Mock("--token", "open sesame")
    browser = Browser(mock.url)
    try:
        browser.open("device/bay-1.feeder-1")
        browser.wait_text("Log in")
        browser.find("#token").send_keys("wrong", Keys.ENTER)
        browser.wait_text("This is not the token of the gateway.")
        browser.find("#token").send_keys("open sesame", Keys.ENTER)
        browser.wait_text("bay-1.feeder-1: online")
        if context.axe:
            browser.find("#logout").click()
            browser.wait_text("Log in")
            found = browser.axe(context.axe.read_text())
            assert not found, found
    finally:
        browser.quit()
        mock.stop()


def test_without_history_and_acknowledging(context):
    mock = Mock("--no-history", "--no-acknowledge")
    browser = Browser(mock.url)
    try:
        browser.open("trends?points=panel.incomer.voltage_l1")
        browser.wait_text("keeps no history")
        rows = "return document.querySelector('.trend-table tbody .num:nth-child(8)')?.textContent"
        browser.wait("a last value", lambda: re.match(r"\d", browser.run(rows) or ""))
        browser.go("alarms")
        browser.wait_text("to acknowledge")
        assert not [b for b in browser.all("button") if "cknowledge" in b.text and b.is_displayed()]
    finally:
        browser.quit()
        mock.stop()


def test_print(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    browser.command("Emulation.setEmulatedMedia", media="print")
    try:
        assert not browser.find("#query").is_displayed()
        assert browser.find(".point-rows .p-value").is_displayed()
    finally:
        browser.command("Emulation.setEmulatedMedia", media="")


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
        assert min(times) < FIRST_VALUE_MS, times


def test_size(context):
    files = [f for f in PAGE.rglob("*") if f.is_file()] + [DYGRAPHS / "dygraph.min.js", DYGRAPHS / "dygraph.min.css"]
    size = sum(len(gzip.compress(f.read_bytes(), 9)) for f in files)
    note("page with chart code, gzip, bytes", size, SIZE_LIMIT)
    assert size < SIZE_LIMIT, size


NEED_MOCK = ("killed", "not_kept", "alarm_on", "trend_zoom", "year", "10000", "lost", "hidden")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url")
    parser.add_argument("--device", default="bay-1.feeder-1")
    parser.add_argument("--axe", type=pathlib.Path)
    parser.add_argument("--only", default="")
    context = parser.parse_args()
    context.mock = None if context.url else Mock()
    context.browser = Browser(context.url or context.mock.url)
    failed = 0
    for name, test in list(globals().items()):
        if not name.startswith("test_") or context.only not in name:
            continue
        if not context.mock and any(word in name for word in NEED_MOCK):
            print(f"left out  {name}")
            continue
        begin = time.time()
        try:
            said = test(context)
            print(f"ok        {name} ({time.time() - begin:.1f} s){f': {said}' if said else ''}", flush=True)
        except Exception:  # pylint: disable=broad-except
            failed += 1
            print(f"FAILED    {name}\n{traceback.format_exc()}", flush=True)
    context.browser.quit()
    if context.mock:
        context.mock.stop()
    for name, value, limit in numbers:
        print(f"{name}: {value}{f' (limit {limit})' if limit else ''}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
