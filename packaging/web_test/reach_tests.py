# SPDX-License-Identifier: Apache-2.0
"""How one gets to a thing: search, links, keyboard, login."""

import re

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from browser import Browser
from common import busy, live, note, open_view, trends, views
from stage import TOKEN, Proxy

LONG_TASK_MS = 50


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


def test_search_in_10000_points(context):
    stage = context.new_stage(points=10000)
    browser = Browser(stage.url)
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
        if (tasks or typing) and busy():
            return busy()
        assert not tasks, rounds
        assert not typing, typing
        return None
    finally:
        browser.quit()
        stage.end()


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
    stage = context.new_stage(token=TOKEN)
    browser = Browser(stage.url)
    try:
        browser.open(f"device/{context.device}")
        browser.wait_text("Log in")
        browser.find("#token").send_keys("wrong", Keys.ENTER)
        browser.wait_text("enter the token of")
        browser.find("#token").send_keys(TOKEN, Keys.ENTER)
        browser.wait_text(f"{context.device}: online")
        if context.axe:
            browser.find("#logout").click()
            browser.wait_text("Log in")
            found = browser.axe(context.axe.read_text())
            assert not found, found
    finally:
        browser.quit()
        stage.end()


def test_below_a_path_of_a_proxy(context):
    stage = context.new_stage(token=TOKEN)
    proxy = Proxy(stage.url)
    browser = Browser(proxy.url)
    try:
        browser.open(f"device/{context.device}")
        browser.wait_text("Log in")
        browser.find("#token").send_keys(TOKEN, Keys.ENTER)
        browser.wait_text(f"{context.device}: online")
        live(browser)
        cookies = {one["path"] for one in browser.driver.get_cookies()}
        assert cookies == {Proxy.PATH}, cookies
        for view, words in views(context).items():
            browser.go(view)
            browser.wait_text(words)
        browser.go(trends(context, "1h"))
        browser.wait("a chart", lambda: browser.all("canvas"))
        failed = [e["message"] for e in browser.driver.get_log("browser") if " 404 " in e["message"]]
        assert not failed, failed
        browser.find("#logout").click()
        browser.wait_text("Log in")
    finally:
        browser.quit()
        proxy.end()
        stage.end()


def test_without_history_and_acknowledging(context):
    stage = context.new_stage(history=False, acknowledge=False)
    browser = Browser(stage.url)
    try:
        browser.open(f"trends?points={context.stage.trends[0]}")
        browser.wait_text("records no history")
        rows = "return document.querySelector('.trend-table tbody .num:nth-child(8)')?.textContent"
        browser.wait("a last value", lambda: re.match(r"\d", browser.run(rows) or ""))
        browser.go("alarms")
        browser.wait_text("to acknowledge")
        assert not [b for b in browser.all("button") if "cknowledge" in b.text and b.is_displayed()]
    finally:
        browser.quit()
        stage.end()
