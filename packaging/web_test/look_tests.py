# SPDX-License-Identifier: Apache-2.0
"""How it looks: colours, widths, print, accessibility, what the browser complains of."""

from common import open_view, trends, views


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
        for width, height in ((360, 740), (390, 844), (1024, 768), (3840, 2160)):
            browser.size(width, height)
            for view, words in [*views(context).items(), (context.trends and trends(context, "1h"), "Maximum")]:
                if not view:
                    continue
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
    open_view(context, trends(context, "1h") if context.trends else "trends", "Add a point")
    if context.trends:
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
                open_view(context, trends(context, "1h") if view == "trends" and context.trends else view, words)
                if view == "trends" and context.trends:
                    browser.wait("a chart", lambda: browser.run("return document.querySelector('.plots').dataset.drawn"))
                violations += [(view, scheme, width, one) for one in browser.axe(source)]
    browser.colours("light")
    browser.size(1440, 900)
    assert not violations, violations
    return None


def test_print(context):
    browser = context.browser
    open_view(context, f"device/{context.device}", "good")
    browser.command("Emulation.setEmulatedMedia", media="print")
    try:
        assert not browser.find("#query").is_displayed()
        assert browser.find(".point-rows .p-value").is_displayed()
    finally:
        browser.command("Emulation.setEmulatedMedia", media="")
