#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of the page in a browser: against the mock server, a gateway with twins, or one that runs somewhere.

usage: test_page.py [--gateway PROGRAM | --url URL] [--device LINE.DEVICE] [--axe axe.min.js] [--only WORD] [--quick]

--quick: only what every visitor sees: values, ages, killed devices, closed ports, frames, alarms, a lost connection.
"""

import argparse
import pathlib
import sys
import time
import traceback

import detail_tests
import figure_tests
import live_tests
import look_tests
import operate_tests
import overview_tests
import reach_tests
import trend_tests
import value_tests
from browser import Browser
from common import numbers
from stage import Gateway, LeftOut, Mock, Remote

SUBJECTS = (live_tests, overview_tests, value_tests, trend_tests, operate_tests, reach_tests, detail_tests, look_tests, figure_tests)


class Context:
    """What a test is given."""

    def __init__(self, options):
        self.axe, self.kind = options.axe, Gateway if options.gateway else Mock
        Gateway.program = options.gateway
        if options.url:
            self.stage = Remote(options.url, options.device)
            self.kind = self.stage.another
        else:
            self.stage = self.kind()
        self.device, self.trends = self.stage.device, self.stage.trends
        self.browser = Browser(self.stage.url)

    def new_stage(self, **options):
        """One that this test alone has; its end() is called by the test."""
        return self.kind(**options)

    def end(self):
        self.browser.quit()
        if not isinstance(self.stage, Remote):
            self.stage.end()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gateway")
    parser.add_argument("--url")
    parser.add_argument("--device", default="bay-1.feeder-1")
    parser.add_argument("--axe", type=pathlib.Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    context = Context(options)
    failed = 0
    for subject in (live_tests,) if options.quick else SUBJECTS:
        for name, test in vars(subject).items():
            if not name.startswith("test_") or options.only not in name:
                continue
            begin = time.time()
            try:
                said = test(context)
                print(f"ok        {name} ({time.time() - begin:.1f} s){f': {said}' if said else ''}", flush=True)
            except LeftOut as why:
                print(f"left out  {name}: {why}", flush=True)
            except Exception:  # pylint: disable=broad-except
                failed += 1
                print(f"FAILED    {name}\n{traceback.format_exc()}", flush=True)
    context.end()
    for name, value, limit in numbers:
        print(f"{name}: {value}{f' (limit {limit})' if limit else ''}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
