# SPDX-License-Identifier: Apache-2.0
"""Operation: what a role may do, and that each act is asked first and does what was read."""

import re

from selenium.webdriver.common.keys import Keys

from browser import Browser
from common import live
from overview_tests import asked, only_mock


class Desk:
    """A gateway of samples with a user of this role, and a browser."""

    def __init__(self, context, role):
        only_mock(context)
        self.stage = context.new_stage(role=role)
        self.browser = Browser(self.stage.url)

    def __enter__(self):
        return self.stage, self.browser

    def __exit__(self, *_):
        self.browser.quit()
        self.stage.end()


def button(browser, text, within="main"):
    return browser.wait(f"the button {text}", lambda: [b for b in browser.all(f"{within} button") if b.text == text and b.is_displayed()])[0]


def open_device(browser, device):
    browser.open(f"device/{device}")
    browser.wait_text(f"{device}:")
    live(browser)


def last(stage):
    return asked(stage)[-1]


def test_a_viewer_has_no_buttons(context):
    with Desk(context, "viewer") as (_, browser):
        for view, words in (("overview", "In maintenance"), ("device/bay-1.feeder-1", "Values"), ("line/drives", "lent"), ("alarms", "tripped")):
            browser.open(view)
            browser.wait_text(words)
            live(browser)
            found = [b.text for b in browser.all("button") if b.is_displayed()]
            wrong = [b for b in found if any(word in b for word in ("cknowledge", "Write", "able", "loan", "onfirm"))]
            assert not wrong, (view, wrong)


def write_button(browser, point):
    row = browser.wait(point, lambda: [r for r in browser.all(".point-row") if r.text.startswith("☆") and f"\n{point}" in r.text])[0]
    return row.find_element("css selector", ".p-act button")


def test_write_asks_with_old_and_new_value_and_says_the_result(context):
    with Desk(context, "operator") as (stage, browser):
        open_device(browser, "bay-1.feeder-1")
        write_button(browser, "active_phase_low_current").click()
        browser.find("#new-value").send_keys(Keys.CONTROL, "a")
        browser.find("#new-value").send_keys("2.5", Keys.ENTER)
        text = browser.wait_text("Old value", ".ask") and browser.text(".ask")
        for words in ("bay-1.feeder-1", "active_phase_low_current", "1.0", "2.5 xIn"):
            assert words in text, text
        assert not asked(stage), "written before the question was answered"
        button(browser, "Write", ".ask").click()
        browser.wait_text("Done, and read back", ".ask")
        path, body = last(stage)
        assert path == "/api/v1/write" and body["value"] == 2.5 and body["expect"] == 1, body
        button(browser, "Close", ".ask").click()
        browser.wait_text("2.50")
        write_button(browser, "active_phase_low_current").click()
        browser.run("const i = document.getElementById('new-value'); i.removeAttribute('max'); i.value = '99'")
        button(browser, "Continue …", ".ask").click()
        button(browser, "Write", ".ask").click()
        browser.wait_text("Not permitted: nothing was sent", ".ask")
        button(browser, "Close", ".ask").click()
        assert not browser.all(".ask")


def test_a_point_with_select_needs_the_tick(context):
    with Desk(context, "operator") as (stage, browser):
        open_device(browser, "bay-1.feeder-1")
        write_button(browser, "setting_group").click()
        browser.run("document.getElementById('new-value').value = '1'")
        button(browser, "Continue …", ".ask").click()
        assert "main" in browser.text(".ask") and "second" in browser.text(".ask")
        button(browser, "Write", ".ask").click()
        assert not asked(stage)
        browser.find(".ask input[type='checkbox']").click()
        button(browser, "Write", ".ask").click()
        browser.wait_text("Done", ".ask")
        assert last(stage)[1] == {"point": "bay-1.feeder-1.setting_group", "value": 1, "confirm": True, "expect": 0}, last(stage)


def test_escape_leaves_the_question_without_an_act(context):
    with Desk(context, "operator") as (stage, browser):
        open_device(browser, "io.ai-4")
        button(browser, "Disable …").click()
        browser.wait_text("io.ai-4", ".ask")
        browser.find(".ask").send_keys(Keys.ESCAPE)
        browser.wait("no question", lambda: not browser.all(".ask"))
        assert not asked(stage)


def test_devices_and_loans(context):
    with Desk(context, "operator") as (stage, browser):
        open_device(browser, "io.ai-4")
        button(browser, "Disable …").click()
        button(browser, "Disable", ".ask").click()
        browser.wait_text("io.ai-4: in maintenance: disabled")
        assert last(stage) == ["/api/v1/devices/disable", {"device": "io.ai-4"}], last(stage)
        browser.wait_text("until the next restart", ".notice")
        browser.go("overview")
        browser.wait_text("io.ai-4", "section[aria-label='In maintenance']")
        assert "disabled by anna at 10.0.0.7 since 20" in browser.text("section[aria-label='In maintenance']")
        [b for b in browser.all("button") if b.get_attribute("aria-label") == "Enable: io.ai-4"][0].click()
        button(browser, "Enable", ".ask").click()
        browser.wait("in use again", lambda: "io.ai-4" not in browser.text("section[aria-label='In maintenance']"))
        button(browser, "End the loan").click()
        button(browser, "End the loan", ".ask").click()
        browser.wait("its line works", lambda: "pump-1" in browser.text("section[aria-label='Lines']"))
        assert last(stage) == ["/api/v1/lines/release", {"line": "drives"}], last(stage)


def test_all_alarms_of_a_line(context):
    with Desk(context, "operator") as (stage, browser):
        browser.open("alarms")
        button(browser, "Acknowledge all 2 of bay-1").click()
        browser.wait("two less", lambda: "4 alarms to acknowledge" in browser.text("h1"))
        assert last(stage) == ["/api/v1/alarms/ack", {"line": "bay-1"}], last(stage)


def test_trial_counts_down_and_is_confirmed_or_taken_back(context):
    with Desk(context, "engineer") as (stage, browser):
        for act, path in (("Confirm", "confirm"), ("Take back", "revert")):
            stage.post("/mock/trial", s=300)
            browser.open("overview")
            browser.wait_text("on trial")
            first = browser.text(".trial strong")
            button(browser, act).click()
            if path == "revert":
                button(browser, "Take back", ".ask").click()
            browser.wait("no trial", lambda: "on trial" not in browser.text())
            assert last(stage)[0] == f"/api/v1/reload/{path}" and last(stage)[1]["applied"].startswith("20"), last(stage)
            assert re.match(r"(5:00|4:\d\d)$", first), first


def test_who_has_written_what(context):
    with Desk(context, "auditor") as (_, browser):
        browser.open("overview")
        browser.wait("the link", lambda: [a for a in browser.all("#views a") if a.text == "Writes"])[0].click()
        browser.wait("the writes", lambda: len(browser.all("main tbody tr")) == 3)
        row = browser.texts("main tbody tr")[2]
        assert "main" in row and "second" in row, f"values have the texts of the point: {row}"
        browser.find("#write-text").send_keys("low_current")
        rows = browser.wait("two of them", lambda: len(browser.all("main tbody tr")) == 2 and browser.texts("main tbody tr"))
        assert "anna at 10.0.0.5" in rows[0] and "not sent" in rows[0] and "2.50" in rows[0], rows


def test_sessions_are_shown_and_ended(context):
    with Desk(context, "engineer") as (stage, browser):
        browser.open("system")
        rows = lambda: browser.texts("section[aria-label='Sessions'] tbody tr")
        browser.wait("two sessions", lambda: len(rows()) == 2)
        [b for b in browser.all("button") if b.get_attribute("aria-label") == "End the session of vera"][0].click()
        browser.wait("one session", lambda: len(rows()) == 1)
        assert last(stage) == ["/api/v1/sessions/end", {"id": "s2"}], last(stage)


def test_a_device_out_of_use_has_no_write(context):
    with Desk(context, "operator") as (_, browser):
        open_device(browser, "bay-1.feeder-1")
        shown = lambda: [b for b in browser.all(".p-act button") if b.is_displayed()]
        browser.wait("buttons", shown)
        button(browser, "Disable …").click()
        button(browser, "Disable", ".ask").click()
        browser.wait_text("disabled by anna at 10.0.0.7 since")
        browser.wait("no button", lambda: not [b for b in shown() if "setting_group" in b.get_attribute("aria-label")])
