#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does `baudgate status` name what is wrong? Every fault of faults*.py on a line of its own, over ptys and sockets.

usage: named_faults.py [--only WORD] [--well] [--times 1] [--seconds 40] [--lines 140] [--show] [--least 0.95] build/release/baudgate

Exit code 1: fewer than `--least` are named, or a line that is well is talked about. --lines: at most so many at once.
--well: only lines on which nothing is wrong. --times: all of it so often. --show: those that are named as well.
--seen: what the exchanges looked like.
"""

import argparse
import collections
import re
import sys
import tempfile

from faults import FAULTS
from faults_blind import BLIND, CLASSES
from faults_invented import INVENTED
from faults_sites import SITES
from rig import Rig
from slaves import KINDS


LONG = 160  # characters of a first sentence
LAG = 0.15  # slaves of a machine that is too busy are what the gateway says that they are: late


class Case:
    """A fault on one protocol in one place: a line of the gateway."""

    def __init__(self, number, fault, kind, where):
        self.fault, self.kind, self.where = fault, kind, where
        self.line = f"line-{number}"
        self.slave = KINDS[kind]()
        self.name = f"{fault.name}, {kind}, {where}"

    def devices(self):
        faulty, other = self.slave.addresses[0], self.slave.addresses[-1]
        if self.where == "alone":
            return {faulty: self.named("ill")}
        return {faulty: self.named("ill"), other: self.named("good" if self.where == "beside" else "ill2")}

    def named(self, word):
        return f"{word}-{self.line[5:]}"

    def config(self, port):
        extra = getattr(self.slave, "extra", "")
        lines = [f"  - name: {self.line}", f"    port: {port}", f"    protocol: {self.slave.name}", "    poll: 1s"]
        if self.slave.serial:
            lines.append(f"    serial: {self.slave.serial}")
        lines.append("    devices:")
        for address, name in self.devices().items():
            own = self.fault.device if name.startswith("ill") else self.fault.neighbour
            lines += [f"      - name: {name}", f"        address: {address}"]
            profile = self.fault.profile
            options = ", ".join(part for part in (f"profile: {profile}" if profile else extra, own) if part)
            lines += ["        " + option for option in split_options(options)]
            if profile:
                continue
            lines.append("        points:")
            lines += ["          - " + point for point in (self.fault.points or self.slave.points)]
        return "\n".join(lines) + "\n"


def split_options(text):
    """At commas outside of braces."""
    depth, start = 0, 0
    for i, c in enumerate(text + ","):
        depth += (c == "{") - (c == "}")
        if c == "," and depth == 0:
            if text[start:i].strip():
                yield text[start:i].strip()
            start = i + 1


def sentences(status, line):
    found = next(one for one in status["lines"] if one["name"] == line)
    said = list(found["advice"])
    for device in found["devices"]:
        said += [f"{device['name']}: {text}" for text in device["advice"]]
    return said


def seen(status, line):
    """What the exchanges of its devices looked like."""
    found = next(one for one in status["lines"] if one["name"] == line)
    return [f"{device['name']} saw {device['seen']}, last: {device['last_reason']}" for device in found["devices"]]


def matches(pattern, text):
    return bool(pattern) and re.search(pattern, text, re.IGNORECASE) is not None


def judge(fault, said):
    if fault.well:
        return "named" if all(": note: " in text for text in said) else "wrong"
    if not said:
        return "silent"
    if matches(fault.never, said[0]):
        return "wrong"
    cause, cure = matches(fault.says, said[0]), matches(fault.cure, said[0])
    if cause and cure:
        return "named"
    if cause or any(matches(fault.says, text) and matches(fault.cure, text) for text in said):
        return "half"
    return "wrong"


def cases_of(only, well):
    found = []
    for fault in FAULTS + SITES + INVENTED + BLIND + CLASSES:
        if well and not fault.well:
            continue
        for kind in fault.on.split():
            for where in fault.where.split():
                case = Case(len(found), fault, kind, where)
                if not only or re.search(only, f"{fault.family}: {case.name}"):
                    found.append(case)
    return found


def batches(cases, most):
    count = -(-len(cases) // most)
    return [cases[i::count] for i in range(count)]


def run(cases, program, seconds, tries=3):
    """(case, sentences, what was seen) of each; of a line that is well what is said at any look."""
    with tempfile.TemporaryDirectory(prefix="named-faults-") as folder:
        rig = Rig(cases, program, folder)
        said, saw = {case.line: [] for case in cases}, {}
        try:
            for look in (5, seconds / 4, seconds / 2, seconds):
                rig.run_until(rig.start + look)
                if rig.process.poll() is not None:
                    sys.exit("the gateway has ended:\n" + open(rig.log.name).read()[-2000:])
                status = rig.status()
                if status is None:
                    sys.exit("the gateway does not answer\n" + open(rig.log.name).read()[-2000:])
                for case in cases:
                    saw[case.line] = seen(status, case.line)
                    if look == seconds or case.fault.well:
                        said[case.line] += [text for text in sentences(status, case.line) if text not in said[case.line]]
        finally:
            rig.stop()
    found = [(case, said[case.line], saw[case.line]) for case in cases]
    again = [case for case in cases if judge(case.fault, said[case.line]) != "named"]
    if rig.lag > LAG and tries > 1 and again:
        print(f"the slaves were up to {1000 * rig.lag:.0f} ms late, as the machine is busy: {len(again)} once more")
        sys.stdout.flush()
        found = [one for one in found if one[0] not in again] + run(again, program, seconds, tries - 1)
    return found


def main():
    parse = argparse.ArgumentParser(usage=__doc__)
    parse.add_argument("program")
    parse.add_argument("--only", default="")
    parse.add_argument("--well", action="store_true")
    parse.add_argument("--times", type=int, default=1)
    parse.add_argument("--seconds", type=float, default=40)
    parse.add_argument("--lines", type=int, default=140)
    parse.add_argument("--least", type=float, default=0.95)
    parse.add_argument("--show", action="store_true")
    parse.add_argument("--seen", action="store_true")
    options = parse.parse_args()
    counts, families = collections.Counter(), collections.defaultdict(collections.Counter)
    talked, healthy, total = 0, 0, 0
    longest = []
    for batch in batches(cases_of(options.only, options.well), options.lines) * options.times:
        for case, said, saw in run(batch, options.program, options.seconds):
            verdict = judge(case.fault, said)
            if case.fault.well:
                talked += verdict != "named"
                healthy += 1
            else:
                counts[verdict] += 1
                families[case.fault.family][verdict] += 1
                total += 1
                longest += said[:1]
            if options.show or verdict != "named":
                print(f"{'TALKED ABOUT' if case.fault.well and verdict != 'named' else verdict:7} {case.name}")
                for text in said + (saw if options.seen else []):
                    print("          " + text)
                sys.stdout.flush()
    for name, its in families.items():
        print(f"{its['named']:4} of {sum(its.values()):3}  {name}")
    share = counts["named"] / max(total, 1)
    print(", ".join(f"{word} {counts[word]}" for word in ("named", "half", "wrong", "silent")) + f" of {total}: {100 * share:.0f} % named; "
          f"{talked} of {healthy} healthy lines talked about; first sentences longer than {LONG}: {sum(len(text) > LONG for text in longest)}")
    for text in sorted(longest, key=len)[:-4:-1]:
        print(f"{len(text)} {text}")
    return 0 if (share >= options.least or not total) and not talked else 1


if __name__ == "__main__":
    sys.exit(main())
