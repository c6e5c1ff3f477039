# SPDX-License-Identifier: Apache-2.0
"""A Chromium that opens the page, and what the tests want to know of it."""

import base64
import json
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

# Notes long tasks and refusals of the content security policy from the begin of every document.
WATCHERS = """
window.longTasks = []; window.refusals = [];
new PerformanceObserver((list) => window.longTasks.push(...list.getEntries().map((e) => [e.startTime, e.duration])))
    .observe({type: 'longtask', buffered: true});
document.addEventListener('securitypolicyviolation', (e) => window.refusals.push(e.violatedDirective + ' ' + e.blockedURI));
"""


class Browser:
    def __init__(self, url):
        self.url = url.rstrip("/")
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1440,900", "--lang=en"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
        self.driver.set_script_timeout(60)
        self.command("Page.addScriptToEvaluateOnNewDocument", source=WATCHERS)

    def command(self, name, **parameters):
        return self.driver.execute_cdp_cmd(name, parameters)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def open(self, view="overview"):
        """Loads the page anew with this view."""
        self.driver.get("about:blank")
        self.driver.get(f"{self.url}/#/{view}")

    def go(self, view):
        self.run("location.hash = arguments[0]", f"#/{view}")

    def find(self, selector):
        return self.driver.find_element("css selector", selector)

    def all(self, selector):
        return self.driver.find_elements("css selector", selector)

    def text(self, selector="main"):
        return self.run("const e = document.querySelector(arguments[0]); return e && e.checkVisibility() ? e.innerText : ''", selector)

    def texts(self, selector):
        """Of all that there are now; those that are empty are left out."""
        return self.run("return [...document.querySelectorAll(arguments[0])].map(e => e.innerText).filter(Boolean)", selector)

    def wait(self, what, condition, seconds=30):
        end = time.time() + seconds
        while True:
            found = condition()
            if found:
                return found
            if time.time() > end:
                raise AssertionError(f"not within {seconds} s: {what}")
            time.sleep(0.05)

    def wait_text(self, words, selector="main", seconds=30):
        return self.wait(f"'{words}' in {selector}", lambda: words in self.text(selector), seconds)

    def size(self, width, height, scale=1):
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale,
                     mobile=False)

    def colours(self, scheme):
        self.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def screenshot(self, path, whole=False):
        shot = self.command("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))

    def complaints(self):
        """Errors of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]

    def axe(self, source):
        self.run(source)
        found = self.driver.execute_async_script(
            "const done = arguments[0]; axe.run(document, {resultTypes: ['violations']}).then(r => done(JSON.stringify("
            "r.violations.map(v => [v.id, v.help, v.nodes.slice(0, 3).map(n => n.html.slice(0, 160) + ' ' + "
            "(n.any[0]?.message || ''))]))))")
        return json.loads(found)

    def quit(self):
        self.driver.quit()
