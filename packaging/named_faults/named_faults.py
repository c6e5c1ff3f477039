#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does `baudgate status` name what is wrong? Every fault of faults.py on a line of its own, over ptys and sockets.

usage: named_faults.py [--only WORD] [--seconds 40] [--lines 140] [--show] [--least 0.95] build/release/baudgate

Exit code 1: fewer than `--least` are named, or a line that is well is talked about. --lines: at most so many at once.
--show: those that are named as well. --seen: what the exchanges looked like.
"""

import argparse
import collections
import heapq
import json
import os
import pty
import re
import select
import socket
import subprocess
import sys
import tempfile
import time
import tty

import ports
from faults import FAULTS
from faults_invented import INVENTED
from faults_sites import SITES
from manners import Exchange, well
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


class Wire:
    """One line: what its slaves hear, and what they say when."""

    def __init__(self, rig, case):
        self.rig, self.case, self.heard, self.last, self.numbers = rig, case, b"", 0.0, {}
        self.spoken, self.idle = 0.0, 9.0  # when something was on the bus last; the silence before a request
        self.fd, self.connection, self.server = None, None, None
        case.slave.elapsed = self.elapsed
        if case.fault.port:
            self.port = case.fault.port(rig.folder)
            return
        if case.slave.serial is None or case.fault.line == "TCP":
            self.server = socket.create_server(("127.0.0.1", 0))
            self.server.setblocking(False)
            rig.poll.register(self.server, select.POLLIN)
            rig.files[self.server.fileno()] = self.accept
            self.port = f"tcp://127.0.0.1:{self.server.getsockname()[1]}"
            if case.fault.drops:
                rig.at(case.fault.drops[0], self.drop)
        else:
            self.fd, keep = pty.openpty()
            tty.setraw(keep)
            rig.kept.append(keep)
            os.set_blocking(self.fd, False)
            self.port = os.ttyname(keep)
            rig.watch(self.fd, self.read)
        for every, data in case.fault.events:
            rig.at(every, lambda every=every, data=data: self.speak(every, data))

    def elapsed(self):
        return time.monotonic() - self.rig.start

    def speak(self, every, data):
        self.write(data(self.case.slave))
        self.rig.at(every, lambda: self.speak(every, data))

    def drop(self):
        """The connection ends, and for a while none is taken."""
        every, away = self.case.fault.drops
        if self.connection:
            self.close()
        if away:
            address = self.server.getsockname()
            self.rig.forget(self.server.fileno())
            self.server.close()
            self.rig.at(away, lambda: self.listen(address))
        self.rig.at(every, self.drop)

    def listen(self, address):
        self.server = socket.create_server(address)
        self.server.setblocking(False)
        self.rig.watch(self.server.fileno(), self.accept)

    def accept(self):
        if self.connection:
            self.close()
        self.connection, _ = self.server.accept()
        if self.case.fault.refuses:
            self.connection.close()
            self.connection = None
            return
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connection.setblocking(False)
        self.fd = self.connection.fileno()
        self.rig.watch(self.fd, self.read)
        if self.case.fault.greeting:
            self.write(self.case.fault.greeting)

    def close(self):
        if self.connection is None:
            return
        self.rig.forget(self.fd)
        self.connection.close()
        self.connection, self.fd = None, None

    def write(self, data):
        if self.fd is None or not data:
            return
        self.spoken = time.monotonic()
        try:
            os.write(self.fd, data)
        except OSError:
            pass

    def read(self):
        try:
            data = os.read(self.fd, 4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            if self.connection:
                self.close()
            return
        now = time.monotonic()
        if now - self.last > 0.1:
            self.heard = b""
        if not self.heard:
            self.idle = now - self.spoken
        self.spoken = now
        self.last = now
        slave = self.case.slave
        requests = slave.requests(self.heard + data)
        while True:
            try:
                address, request, reply = next(requests)
            except StopIteration as end:
                self.heard = end.value or b""
                return
            self.answer(address, request, reply)
            if self.fd is None:
                return

    def answer(self, address, request, reply):
        name = self.case.devices().get(address)
        if name is None or reply is None:
            return
        number = self.numbers.get(address, 0)
        self.numbers[address] = number + 1
        manner = self.case.fault.how if name.startswith("ill") else well
        exchange = Exchange(self.case.slave, self, address, request, reply, number)
        said = ports.CLOSE if manner is ports.CLOSE else manner(exchange)
        if said is ports.CLOSE:
            self.close()
            return
        for delay, data in said:
            self.rig.at(delay, lambda data=data: self.close() if data is ports.CLOSE else self.write(data))


class Rig:
    """A gateway and all wires of it."""

    def __init__(self, cases, program, folder):
        self.folder, self.poll, self.files, self.times, self.kept = folder, select.poll(), {}, [], []
        self.start = self.woken = time.monotonic()
        self.lag = 0.0  # by which the slaves were later than they should have been
        self.wires = [Wire(self, case) for case in cases]
        self.config = os.path.join(folder, "gateway.yaml")
        self.socket = os.path.join(folder, "gateway.sock")
        with open(self.config, "w") as out:
            out.write(f"gateway: {{ name: named-faults, socket: {self.socket}, state: {folder}/state }}\nlines:\n")
            out.writelines(wire.case.config(wire.port) for wire in self.wires)
        self.log = open(os.path.join(folder, "log"), "w")
        self.program = program
        self.process = subprocess.Popen([program, "run", "-c", self.config], stdout=self.log, stderr=self.log)

    def watch(self, fd, call):
        self.files[fd] = call
        self.poll.register(fd, select.POLLIN)

    def forget(self, fd):
        self.files.pop(fd, None)
        self.poll.unregister(fd)

    def at(self, delay, call):
        heapq.heappush(self.times, (time.monotonic() + delay, len(self.times), id(call), call))

    def run_until(self, end):
        while (now := time.monotonic()) < end:
            self.lag = max(self.lag, now - self.woken)
            while self.times and self.times[0][0] <= now:
                heapq.heappop(self.times)[-1]()
            until = min(self.times[0][0] if self.times else end, end)
            self.woken = max(until, time.monotonic())
            for fd, _ in self.poll.poll(max(0.0, until - time.monotonic()) * 1000):
                if fd in self.files:
                    self.files[fd]()

    def status(self):
        """While the wires go on."""
        ask = subprocess.Popen([self.program, "status", "--json", "--socket", self.socket], stdout=subprocess.PIPE)
        os.set_blocking(ask.stdout.fileno(), False)
        text, end = b"", time.monotonic() + 20
        while time.monotonic() < end:
            ended = ask.poll() is not None
            text += ask.stdout.read() or b""
            if ended:
                return json.loads(text) if text else None
            self.run_until(time.monotonic() + 0.02)
        ask.kill()
        return None

    def stop(self):
        self.process.terminate()
        end = time.monotonic() + 10
        while self.process.poll() is None and time.monotonic() < end:
            self.run_until(time.monotonic() + 0.05)
        if self.process.poll() is None:
            self.process.kill()
        for wire in self.wires:
            for one in (wire.connection, wire.server):
                if one:
                    one.close()
            if wire.fd is not None and not wire.connection and not wire.server:
                os.close(wire.fd)
        for fd in self.kept:
            os.close(fd)
        self.log.close()


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
        return "wrong" if said else "named"
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


def cases_of(only):
    found = []
    for fault in FAULTS + SITES + INVENTED:
        for kind in fault.on.split():
            for where in fault.where.split():
                case = Case(len(found), fault, kind, where)
                if not only or re.search(only, f"{fault.family}: {case.name}"):
                    found.append(case)
    return found


def batches(cases, most):
    count = -(-len(cases) // most)
    return [cases[i::count] for i in range(count)]


def run(cases, program, seconds, tries=2):
    """(case, sentences) of each; what is said of a line that is well, at any look."""
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
        if rig.lag > LAG and tries > 1:
            print(f"the slaves were up to {1000 * rig.lag:.0f} ms late, as the machine is busy: once more")
            return run(cases, program, seconds, tries - 1)
        return [(case, said[case.line], saw[case.line]) for case in cases]


def main():
    parse = argparse.ArgumentParser(usage=__doc__)
    parse.add_argument("program")
    parse.add_argument("--only", default="")
    parse.add_argument("--seconds", type=float, default=40)
    parse.add_argument("--lines", type=int, default=140)
    parse.add_argument("--least", type=float, default=0.95)
    parse.add_argument("--show", action="store_true")
    parse.add_argument("--seen", action="store_true")
    options = parse.parse_args()
    counts, families = collections.Counter(), collections.defaultdict(collections.Counter)
    talked, total = 0, 0
    longest = []
    for batch in batches(cases_of(options.only), options.lines):
        for case, said, saw in run(batch, options.program, options.seconds):
            verdict = judge(case.fault, said)
            if case.fault.well:
                talked += verdict != "named"
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
          f"{talked} healthy lines talked about; first sentences longer than {LONG}: {sum(len(text) > LONG for text in longest)}")
    for text in sorted(longest, key=len)[:-4:-1]:
        print(f"{len(text)} {text}")
    return 0 if (share >= options.least or not total) and not talked else 1


if __name__ == "__main__":
    sys.exit(main())
