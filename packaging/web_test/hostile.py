#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Attacks the web server of a gateway with twins, while a viewer looks on who must not notice.

usage: hostile.py PROGRAM [SECONDS]
"""

import json
import os
import pathlib
import random
import socket
import sys
import threading
import time
import urllib.request

from stage import Gateway

PATHS = ["/../../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/js/../../../../etc/shadow", "//etc/passwd",
         "/js/%00main.js", "/js/main.js%00.html", "/%", "/%zz", "/api/v1/points?q=%", "/api/v1/history?point=%00", "/?" + "a=b&" * 900,
         "/api/v1/history?point=io.ai-1.input_1&pixels=999999999&since_ms=-9223372036854775808&until_ms=9223372036854775807",
         "/api/v1/points/stream?device=" + "x" * 4000, "http://evil.example/api/v1/status", "*", "", "/\\..\\..\\etc\\passwd",
         "/api/v1/recorded?line=../../etc", "/api/v1/history.csv?point=*.*.*", "/api/v1/map?device=io.ai-1%0d%0aX: y"]


class Attack:
    def __init__(self, gateway):
        self.gateway, self.port, self.failed = gateway, gateway.port, []
        self.host = f"Host: 127.0.0.1:{self.port}\r\n"

    def open(self, receive_buffer=0):
        one = socket.socket()
        if receive_buffer:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        one.settimeout(5)
        one.connect(("127.0.0.1", self.port))
        return one

    def ask(self, head):
        """The status of the answer; 0: the connection was closed without one."""
        with self.open() as one:
            try:
                one.sendall(head.encode("latin-1"))
                answer = one.recv(65536)
            except OSError:
                return 0, b""
        return (int(answer.split()[1]) if answer.startswith(b"HTTP/") else 0), answer

    def expect(self, what, got, wanted):
        if got not in wanted:
            self.failed.append(f"{what}: {got}, not one of {wanted}")

    def foreign_hosts(self):
        for host in ("evil.example", "127.0.0.1.evil.example", "localhost.evil.example:1", "[::2]", "127.0.0.2", "", "a" * 3000):
            status, _ = self.ask(f"GET /api/v1/status HTTP/1.1\r\nHost: {host}\r\n\r\n")
            self.expect(f"Host {host[:30]!r}", status, (421, 400))
        status, _ = self.ask(f"POST /api/v1/alarms/ack HTTP/1.1\r\n{self.host}Origin: http://evil.example\r\nContent-Length: 2\r\n\r\n{{}}")
        self.expect("a foreign Origin", status, (403,))
        status, _ = self.ask(f"GET /api/v1/status HTTP/1.1\r\n{self.host}Sec-Fetch-Site: same-site\r\n\r\n")
        self.expect("another page of the same site", status, (403,))

    def paths(self):
        for path in PATHS:
            status, answer = self.ask(f"GET {path} HTTP/1.1\r\n{self.host}\r\n")
            if b"root:" in answer:
                self.failed.append(f"{path} shows a file of the machine")
            if status >= 500 and status != 503:
                self.failed.append(f"{path[:60]}: {status}")

    def floods(self):
        for head in ("X-A: b\r\n" * 5000, "X: " + "a" * 200000 + "\r\n", "Cookie: " + "baudgate=1;" * 3000 + "\r\n"):
            status, _ = self.ask(f"GET / HTTP/1.1\r\n{self.host}{head}\r\n")
            self.expect("a flood of headers", status, (0, 413, 431))
        for length in ("99999999999999999999", "-1", "5000000000", "0x10"):
            status, _ = self.ask(f"POST /login HTTP/1.1\r\n{self.host}Content-Length: {length}\r\n\r\n{'a' * 9000}")
            self.expect(f"Content-Length {length}", status, (0, 400, 413, 503))

    def nonsense(self):
        for _ in range(200):
            noise = bytes(random.randrange(256) for _ in range(random.randrange(1, 600)))
            with self.open() as one:
                try:
                    one.sendall(noise)
                except OSError:
                    pass

    def slow_readers(self):
        """Streams and large answers that nobody takes; gives back their sockets."""
        slow = []
        for path in ("/api/v1/points/stream", "/api/v1/points", "/metrics", "/api/v1/trace?line=io") * 20:
            one = self.open(receive_buffer=2048)
            one.sendall(f"GET {path} HTTP/1.1\r\n{self.host}\r\n".encode())
            slow.append(one)
        return slow

    def half_open(self):
        silent = []
        for number in range(1000):
            try:
                one = self.open()
                if number % 2:
                    one.sendall(f"GET /api/v1/status HTTP/1.1\r\n{self.host}"[:5 + number % 50].encode())
                silent.append(one)
            except OSError:
                pass
        return silent


class Viewer(threading.Thread):
    """Reads the stream and notes the longest silence."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.stream, self.longest, self.lost, self.ended = urllib.request.urlopen(url + "/api/v1/points/stream"), 0, False, False

    def run(self):
        heard = time.monotonic()
        while not self.ended:
            if not self.stream.readline():
                self.lost = True
                return
            now = time.monotonic()
            self.longest, heard = max(self.longest, now - heard), now


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def memory(pid):
    return next(int(line.split()[1]) for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines() if "VmRSS" in line)


def status(gateway):
    with urllib.request.urlopen(gateway.url + "/api/v1/status", timeout=5) as answer:
        return json.load(answer)


def main():
    Gateway.program = sys.argv[1]
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60
    gateway = Gateway()
    attack = Attack(gateway)
    pid = gateway.process.pid
    try:
        time.sleep(3)
        viewer = Viewer(gateway.url)
        viewer.start()
        before, rounds, kept = (descriptors(pid), memory(pid)), 0, 0
        end = time.monotonic() + seconds
        while time.monotonic() < end or not rounds:
            held = attack.slow_readers() + attack.half_open()
            for one in (attack.foreign_hosts, attack.paths, attack.floods, attack.nonsense):
                one()
            if not status(gateway)["lines"]:
                attack.failed.append("no status beside the attack")
            kept = max(kept, memory(pid))
            for one in held:
                one.close()
            rounds += 1
        time.sleep(12)  # what is still held is given up
        after = (descriptors(pid), memory(pid))
        devices = [d for line in status(gateway)["lines"] for d in line["devices"] if line["port_state"] == "open"]
        bad = [d["name"] for d in devices if d["state"] not in ("online", "degraded")]
        viewer.ended = True
        print(f"{rounds} rounds; the viewer heard nothing for {viewer.longest:.1f} s at most; descriptors {before[0]}, then {after[0]}; "
              f"memory {before[1]} kB, at most {kept}, then {after[1]}; missed polls {sum(d['missed'] for d in devices)}")
        if viewer.lost or viewer.longest > 3:
            attack.failed.append(f"the viewer was {'dropped' if viewer.lost else 'left in silence'}")
        if after[0] > before[0] + 4:
            attack.failed.append("descriptors are not given back")
        if kept > before[1] + 100000:
            attack.failed.append("memory without bound")
        if bad:
            attack.failed.append(f"devices that do not answer: {bad}")
        if gateway.process.poll() is not None:
            attack.failed.append(f"the gateway has ended: {gateway.process.returncode}")
        for one in sorted(set(attack.failed)):
            print("FAILED", one)
        sys.exit(1 if attack.failed else 0)
    finally:
        log = (gateway.folder / "log").read_text(errors="replace")
        if "Sanitizer" in log:
            print(log)
        gateway.end()


if __name__ == "__main__":
    main()
