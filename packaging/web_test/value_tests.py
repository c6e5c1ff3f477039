# SPDX-License-Identifier: Apache-2.0
"""Values: a device's page begins with them, favourites, the view of all points, and the search."""

import re

from selenium.webdriver.common.keys import Keys

from common import live, open_view
from overview_tests import only_mock


def test_values_come_first(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    assert browser.text("main section h2").startswith("Values")
    browser.run("document.querySelectorAll('details.folded').forEach((part) => { part.open = false; })")
    assert not [f for f in browser.all(".facts") if f.is_displayed()], "counters are not folded"


def test_values_are_aligned_at_the_point_and_have_a_raw_value(context):
    only_mock(context)
    browser = context.browser
    open_view(context, "device/panel.incomer", "good")
    browser.wait("values", lambda: re.search(r"\d", browser.text(".point-rows .p-value")))
    places = browser.run("""return [...document.querySelectorAll('.point-rows .p-value:not(.word) .fraction')]
        .filter((e) => e.textContent).slice(0, 20).map((e) => Math.round(e.getBoundingClientRect().left))""")
    assert len(places) > 10 and len(set(places)) == 1, places
    raw = browser.find(".point-rows .point-row:not(.heading) .p-value").get_attribute("title")
    assert re.match(r"raw value \d+\.\d{2,}", raw), raw
    shown = [v.split("\n")[-1] for v in browser.texts(".point-rows .p-value")[:2]]
    assert all(re.search(r"\d\.\d$", v) for v in shown), shown


def test_groups_are_headings_and_commands_are_write_only(context):
    only_mock(context)
    browser = context.browser
    open_view(context, f"device/{context.device}", "Read fast")
    headings = browser.texts(".point-row.heading")
    assert headings == ["Read fast", "Read slowly", "Read daily", "Read once", "Write only"], headings
    row = [r for r in browser.all(".point-row.none") if "reset_indications" in r.text][0]
    assert "write only" in row.text and "waiting" not in browser.text(), row.text
    browser.find("#marred").click()
    browser.wait("no row", lambda: "reset_indications" not in browser.text())
    browser.find("#marred").click()


def test_small_curve_leads_to_the_trend(context):
    only_mock(context)
    browser = context.browser
    open_view(context, "device/panel.incomer", "good")
    browser.wait("a curve", lambda: browser.all(".point-rows .spark path[d]:not(.limit)"))
    browser.wait("a limit", lambda: browser.all(".point-rows .spark .limit[d]"))
    browser.find(".point-rows a.trend:not([hidden])").click()
    browser.wait_text("Maximum")
    assert "points=panel.incomer.voltage_l1" in browser.driver.current_url


def test_favourites_are_the_first_page(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    star = browser.all(".point-row:not(.heading) .star")[0]
    star.click()
    name = star.get_attribute("value")
    browser.driver.get("about:blank")
    browser.driver.get(browser.url + "/")
    browser.wait_text(name.rsplit(".", 1)[1], ".tile")
    browser.wait("a value", lambda: re.search(r"\d", browser.text(".tile-value")))
    assert browser.find("#views a").text == "Favourites"
    browser.find(".tile .star").click()
    browser.driver.get("about:blank")
    browser.driver.get(browser.url + "/")
    browser.wait_text("Devices that work")


def test_points_are_sorted_and_filtered(context):
    only_mock(context)
    browser = context.browser
    open_view(context, "points?q=voltage_l1", "points have")
    live(browser)
    names = lambda: browser.texts(".point-rows .p-name")
    values = lambda: [float(v.split("\n")[-1]) for v in browser.texts(".point-rows .p-value") if re.search(r"\d$", v)]
    heads = [b for b in browser.all(".sort") if b.text.startswith("Value")]
    heads[0].click()
    browser.wait("the largest first", lambda: len(values()) > 5 and values()[0] == max(values()))
    assert "sort=value" in browser.driver.current_url
    browser.run("const s = document.querySelector('.field select'); s.value = 'panel'; s.dispatchEvent(new Event('change'))")
    browser.wait("one line", lambda: names() and all(n.startswith("panel.") for n in names()))
    browser.open("points?writable=1")
    browser.wait("the writable ones", lambda: names() and all(n.startswith("bay-1.feeder-1.") for n in names()))
    browser.open("points?quality=poor&line=io")
    browser.wait("bad ones", lambda: names() and not browser.all(".point-rows .point-row.good"))
    assert not [n for n in names() if "reset" in n]


def test_search_finds_lines_and_devices_and_enter_opens(context):
    browser = context.browser
    line, _, device = context.device.partition(".")
    for text, place in ((context.device, f"#/device/{context.device}"), (line, f"#/line/{line}"),
                        (device + " current", f"?point=")):
        open_view(context, "overview", "Devices")
        # Enter counts as well if it comes before the points do.
        browser.find("#query").send_keys(text, Keys.ENTER)
        browser.wait(place, lambda: place in browser.driver.current_url)


def test_search_finds_alarms(context):
    only_mock(context)
    open_view(context, "points?q=tripped", "points have")
    found = context.browser.wait_text("stage I> tripped", ".places") and context.browser.text(".places")
    assert "alarm, high" in found, found


def test_a_tile_shows_that_its_value_is_beyond_a_limit(context):
    only_mock(context)
    browser = context.browser
    browser.open("overview")
    browser.run("localStorage.setItem('favourites /', '[\"bay-1.feeder-1.active_phase_low_current\"]')")
    try:
        open_view(context, "favourites", "active_phase_low_current")
        browser.run("import('./js/store.js').then(async ({pointsOf, take}) => {"
                    "const {id} = (await pointsOf('bay-1.feeder-1')).find((one) => one.point === 'active_phase_low_current');"
                    "take({values: [[id, 7.5, 192, 'good', Date.now(), '7.50']]}, false); })")
        browser.wait_text("good, above 5", ".tile")
    finally:
        browser.run("localStorage.removeItem('favourites /')")
