# SPDX-License-Identifier: Apache-2.0
"""What the tests of all subjects share."""

import os

from stage import LeftOut

numbers = []


def note(name, value, limit):
    """A figure for the end of the report; no limit: None."""
    numbers.append((name, value, limit))


def busy():
    """Why measured times are not judged; empty: they are."""
    load = os.getloadavg()[0]
    return f"times are not judged: the load of the machine is {load:.1f}" if load > os.cpu_count() else ""


def views(context):
    """Every view, and words that it has."""
    line, _, _ = context.device.partition(".")
    return {"overview": "Devices", f"device/{context.device}": "Communication", f"line/{line}": "Trace",
            "alarms": "Events", "trends": "Add a point", "points": "points;", "system": "Configuration in force"}


def live(browser):
    browser.wait("live", lambda: browser.text("#link") == "live")


def open_view(context, view, words):
    context.browser.open(view)
    context.browser.wait_text(words)
    live(context.browser)


def trends(context, span):
    if not context.trends:
        raise LeftOut("nobody knows which points are kept")
    return f"trends?range={span}&points={','.join(context.trends)}"
