#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the page and the metrics of a gateway with 10,000 points cost, and whether others notice.

usage: page.py BUILD

100 twins with 100 points each, of which ten are polled each second, every value another one: 1,000 changes a second. Phases with and without
200 viewers of the stream take turns, while one Modbus client reads and one goes through a route.
"""

import json
import multiprocessing
import os
import pathlib
import selectors
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

LINES, POINTS, BUSY_LINES, VIEWERS, ROUNDS, PHASE_S = 100, 100, 10, 200, 4, 8
TICK = os.sysconf("SC_CLK_TCK")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def configuration(folder, web, modbus):
    """The lines of `baudgate_bench be-scale-twins`, most of them read once, and a drive behind a route."""
    points = "".join(f"          - {{ name: v{i}, read: V{i}, type: float32, modbus: {2 * (i - 1)}, "
                     f"simulate: [0, 100] }}\n" for i in range(1, POINTS + 1))
    lines = "".join(f"  - name: line{n}\n    port: {folder}/{n}\n    protocol: spabus\n    devices:\n"
                    f"      - name: relay{n}\n        address: 1\n        unit: {n + 1}\n"
                    f"        poll: {'1s' if n < BUSY_LINES else '1h'}\n"
                    f"        max_items: 25\n        points:\n{points}" for n in range(LINES))
    return (f"gateway: {{ name: page-bench, socket: {folder}/gate.sock }}\nweb: {{ listen: \"127.0.0.1:{web}\" }}\n"
            f"modbus:\n  listen: [ \"127.0.0.1:{modbus}\" ]\n  routes: [ {{ units: \"200\", line: drive, remap: 1 }} ]\n"
            f"lines:\n  - {{ name: drive, port: {folder}/drive, serial: 115200 8E1, protocol: modbus_rtu }}\n{lines}")


def processor(pid):
    """Seconds that the process has had."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def watch(port, count, ready, stop):
    """Viewers who read everything and keep nothing."""
    ask = f"GET /api/v1/points/stream HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
    selector = selectors.DefaultSelector()

    def read(patience):
        for key, _ in selector.select(patience):
            if not key.fileobj.recv(1 << 20):
                sys.exit("a viewer was dropped")

    for _ in range(count):
        viewer = socket.create_connection(("127.0.0.1", port))
        viewer.sendall(ask)
        selector.register(viewer, selectors.EVENT_READ)
        read(0)
    settled = time.monotonic() + 2  # the snapshots
    while not stop.is_set():
        read(0.1)
        if time.monotonic() > settled:
            ready.set()


class Client(threading.Thread):
    """A Modbus client that asks again as soon as it is answered."""

    def __init__(self, port, unit, function):
        super().__init__(daemon=True)
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.request = struct.pack(">HHHBBHH", 1, 0, 6, unit, function, 0, 2)
        self.replies = 0

    def run(self):
        try:
            while self.ask():
                self.replies += 1
        except OSError:
            pass  # the gateway has ended

    def ask(self):
        self.socket.sendall(self.request)
        return self.socket.recv(300)


class Bench:
    def __init__(self, build, folder):
        self.build, self.folder, self.children = build, folder, []
        self.web, self.modbus = free_port(), free_port()
        self.spawn("baudgate_bench", "be-scale-twins", folder)
        self.spawn("baudgate", "simulate", "--protocol", "modbus_rtu", "--profile", "generic-meter", "--address", "1",
                   "--pty", f"{folder}/drive", "--baud", "115200 8E1", "--think", "1ms")
        while not (folder / "ready").exists() or not (folder / "drive").exists():
            time.sleep(0.1)
        (folder / "gate.yaml").write_text(configuration(folder, self.web, self.modbus))
        self.gateway = self.spawn("baudgate", "run", "-c", folder / "gate.yaml")
        while self.get("/metrics").count("baudgate_point_value{") < LINES * POINTS:
            time.sleep(0.5)

    def spawn(self, program, *words):
        where = self.build / program if (self.build / program).exists() else self.build / "gateway" / program
        child = subprocess.Popen([where, *words], env={**os.environ, "STATE_DIRECTORY": str(self.folder)},
                                 stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.children.append(child)
        return child

    def get(self, path):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.web}{path}") as answer:
                return answer.read().decode()
        except OSError:
            return ""

    def counters(self):
        """Exchanges and missed polls of all devices."""
        devices = [d for line in json.loads(self.get("/api/v1/status"))["lines"] for d in line["devices"]]
        return (sum(d["exchanges"] for d in devices), sum(d["missed"] for d in devices))

    def phase(self, clients):
        """What happens in some seconds: (processor, replies to each client a second, exchanges a second, missed)."""
        exchanges, missed = self.counters()
        replies = [c.replies for c in clients]
        used, begin = processor(self.gateway.pid), time.monotonic()
        time.sleep(PHASE_S)
        took = time.monotonic() - begin
        used = (processor(self.gateway.pid) - used) / took
        rates = [(c.replies - before) / took for c, before in zip(clients, replies)]
        now, missed_now = self.counters()
        return used, rates, (now - exchanges) / took, missed_now - missed

    def watched(self, measure):
        """As measure(), with viewers."""
        ready, stop = multiprocessing.Event(), multiprocessing.Event()
        viewers = multiprocessing.Process(target=watch, args=(self.web, VIEWERS, ready, stop))
        viewers.start()
        ready.wait(60)
        try:
            return measure()
        finally:
            stop.set()
            viewers.join()
            time.sleep(2)  # until the gateway has noticed that they are gone: it has room for 256
            if viewers.exitcode:
                sys.exit(1)

    def scrape(self):
        """Processor time of one scrape, in milliseconds."""
        count = 20
        used, begin = processor(self.gateway.pid), time.monotonic()
        time.sleep(2)
        idle = (processor(self.gateway.pid) - used) / (time.monotonic() - begin)
        used, begin = processor(self.gateway.pid), time.monotonic()
        for _ in range(count):
            text = self.get("/metrics")
        cost = processor(self.gateway.pid) - used - idle * (time.monotonic() - begin)
        return cost / count * 1000, len(text)

    def end(self):
        for child in self.children:
            child.kill()
            child.wait()


def verdict(reached):
    return "reached" if reached else "MISSED"


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(build, pathlib.Path(folder))
        try:
            ms, size = bench.scrape()
            print(f"a scrape of {LINES * POINTS} points, {size // 1000} kB: {ms:.1f} ms of a core  {verdict(ms < 50)}")
            middle = lambda phases, of: statistics.median(of(p) for p in phases)
            quiet, seen = [], []
            for _ in range(ROUNDS):
                quiet.append(bench.phase([]))
                seen.append(bench.watched(lambda: bench.phase([])))
            used = lambda p: p[0]
            cost = middle(seen, used) - middle(quiet, used)
            print(f"{VIEWERS} viewers, {BUSY_LINES * POINTS} changes a second: {100 * cost:.1f} % of a core beside "
                  f"{100 * middle(quiet, used):.1f} % without  {verdict(cost < 0.05)}")
            missed = [sum(p[3] for p in phases) for phases in (quiet, seen)]
            print(f"missed polls: {missed[0]} without viewers, {missed[1]} with  {verdict(missed[1] <= missed[0])}")
            # Clients that ask without a pause take all the time that there is: rates only.
            clients = [Client(bench.modbus, 1, 4), Client(bench.modbus, 200, 4)]
            for client in clients:
                client.start()
            without, beside = [], []
            for _ in range(ROUNDS):
                without.append(bench.phase(clients))
                beside.append(bench.watched(lambda: bench.phase(clients)))
            for name, of in (("exchanges of the lines", lambda p: p[2]), ("reads of Modbus", lambda p: p[1][0]),
                             ("reads through a route", lambda p: p[1][1])):
                ratio = middle(beside, of) / middle(without, of)
                print(f"{name} a second: {middle(without, of):.0f} without viewers, {middle(beside, of):.0f} with: "
                      f"{ratio:.3f}  {verdict(ratio > 0.95)}")
        finally:
            bench.end()


if __name__ == "__main__":
    main()
