#!/usr/bin/env python3
"""Measures which share of its requests a client keeps while another host attacks the gateway.

usage: tests/system/fair_shares.py PROGRAM [SECONDS]

The attacker uses 127.0.0.1, the client 127.0.0.2. docs/performance.md has the table. The script decides nothing: it
prints the share of answered requests without and with each attack.
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import contextlib
import os
import pathlib
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tty

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 5.0
READ = bytes([3, 0, 0, 0, 1])


def free_port():
    with contextlib.closing(socket.socket()) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def connect(port, source="127.0.0.1"):
    one = socket.socket()
    one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    one.bind((source, 0))
    one.settimeout(6)
    one.connect(("127.0.0.1", port))
    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return one


def frame(number, unit, pdu):
    return struct.pack(">HHHB", number & 0xFFFF, 0, len(pdu) + 1, unit) + pdu


def ask(one, number, unit, pdu):
    """Returns the function code of the reply, or None if none came."""
    try:
        one.sendall(frame(number, unit, pdu))
        head = b""
        while len(head) < 8:
            got = one.recv(8 - len(head))
            if not got:
                return None
            head += got
        left = struct.unpack(">H", head[4:6])[0] - 2
        while left > 0:
            left -= len(one.recv(left))
        return head[7]
    except OSError:
        return None


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)


def slaves(link, stop):
    """Answers functions 3 and 6 of all slaves at a pty, 5 ms after each request."""
    master, slave = os.openpty()
    tty.setraw(slave)
    pathlib.Path(link).symlink_to(os.ttyname(slave))
    registers = collections.defaultdict(int)
    request = b""
    while not stop.is_set():
        if not select.select([master], [], [], 0.1)[0]:
            continue
        request += os.read(master, 256)
        if len(request) < 8:
            continue
        unit, function, address, value = struct.unpack(">BBHH", request[:6])
        request = b""
        time.sleep(0.005)
        if function == 6:
            registers[unit, address] = value
            reply = struct.pack(">BBHH", unit, 6, address, value)
        else:
            words = [registers[unit, address + i] for i in range(value)]
            reply = struct.pack(f">BBB{value}H", unit, function, 2 * value, *words)
        os.write(master, reply + crc(reply))


class Attack:
    """Threads that run until the end of the block."""

    def __init__(self, *works):
        self.stop = threading.Event()
        self.threads = [threading.Thread(target=work, args=(self.stop,), daemon=True) for work in works]

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        time.sleep(1)
        return self

    def __exit__(self, *_):
        self.stop.set()
        for thread in self.threads:
            thread.join()


def flood(port, connections, make):
    """Keeps 32 requests under way on each connection, and reads all replies."""

    def work(stop):
        sockets = [connect(port) for _ in range(connections)]
        for one in sockets:
            one.setblocking(False)
        number = 0
        while not stop.is_set():
            for one in sockets:
                try:
                    one.send(b"".join(frame(number + i, *make(number + i)) for i in range(32)))
                    number += 32
                except BlockingIOError:
                    pass
            for one in select.select(sockets, [], [], 0.01)[0]:
                try:
                    one.recv(65536)
                except BlockingIOError:
                    pass
        for one in sockets:
            one.close()

    return work


def served(port, unit, pdu, seconds=None):
    """Returns answered and asked requests of a client at another host, one after the other."""
    asked = good = 0
    end = time.monotonic() + (seconds or SECONDS)
    one = None
    while time.monotonic() < end:
        asked += 1
        if one is None:
            try:
                one = connect(port, "127.0.0.2")
            except OSError:
                time.sleep(0.05)
                continue
        reply = ask(one, asked, unit, pdu)
        if reply == pdu[0]:
            good += 1
        elif reply is None:
            one.close()
            one = None
    return good, asked


def show(name, before, during):
    print(f"{name:<58} {before[0]:>6}/{before[1]:<6} {during[0]:>6}/{during[1]:<6} "
          f"{100 * during[0] / max(during[1], 1):6.1f} %", flush=True)


def http(port, source, request, timeout=5):
    try:
        one = connect(port, source)
        one.settimeout(timeout)
        one.sendall(request)
        return one.recv(64)
    except OSError:
        return b""


def pages(port, seconds=None):
    request = (f"GET /api/v1/status HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
               "Authorization: Bearer 0123456789abcdef\r\nConnection: close\r\n\r\n").encode()
    asked = good = 0
    end = time.monotonic() + (seconds or SECONDS)
    while time.monotonic() < end:
        asked += 1
        good += http(port, "127.0.0.2", request).startswith(b"HTTP/1.1 200")
    return good, asked


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="baudgate-fair-"))
    low, normal, small, elsewhere, page = (free_port() for _ in range(5))
    (folder / "token").write_text("0123456789abcdef\n")
    (folder / "token").chmod(0o600)
    server = f"""
gateway: {{ name: elsewhere, state: {folder}/state }}
dds: {{ enabled: false }}
modbus: {{ listen: "127.0.0.1:{elsewhere}", routes: [ {{ units: 1-10, line: bus }} ] }}
lines: [ {{ name: bus, port: {folder}/bus2, protocol: modbus_rtu }} ]
"""
    config = f"""
gateway: {{ name: fair, state: {folder}/state }}
dds: {{ enabled: false }}
web: {{ listen: 127.0.0.1:{page}, token: {{ file: {folder}/token }} }}
modbus:
  listen:
    - {{ at: "127.0.0.1:{low}", permit: read, priority: low }}
    - {{ at: "127.0.0.1:{normal}" }}
    - {{ at: "127.0.0.1:{small}", max_clients: 64 }}
  routes:
    - {{ units: 1-10, line: bus }}
    - {{ units: 11-20, server: "127.0.0.1:{elsewhere}", remap: 1 }}
lines:
  - {{ name: bus, port: {folder}/bus, protocol: modbus_rtu, devices: [ {{ name: drive, address: 5, unit: 50, profile: {folder}/drive.yaml, write: allow }} ] }}
"""
    (folder / "drive.yaml").write_text("""
device: drive
points:
  - { name: speed, read: holding 0, write: holding 0, type: uint16, access: rw, modbus: 0 }
  - { name: torque, read: holding 1, write: holding 1, type: uint16, access: rw, modbus: 1 }
""")
    (folder / "gateway.yaml").write_text(config)
    (folder / "elsewhere.yaml").write_text(server)
    processes = []

    def run(*words):
        log = open(folder / f"log{len(processes)}", "wb")
        processes.append(subprocess.Popen([PROGRAM, *words], stdout=log, stderr=log))

    stop = threading.Event()
    for name in ("bus", "bus2"):
        threading.Thread(target=slaves, args=(folder / name, stop), daemon=True).start()
    time.sleep(0.5)
    try:
        run("run", "-c", str(folder / "elsewhere.yaml"))
        run("run", "-c", str(folder / "gateway.yaml"))
        time.sleep(4)
        measure(low, normal, small, page)
    finally:
        for process in processes:
            process.send_signal(signal.SIGTERM)
        for process in processes:
            process.wait(10)
        stop.set()
        print("logs:", folder, {path.name: len(path.read_bytes().splitlines()) for path in folder.glob("log*")})


def measure(low, normal, small, page):
    print(f"{'attack of one host':<58} {'before':>13} {'during':>13}    share")
    read = lambda i: (1 + i % 4, READ)
    write = lambda i: (50, bytes([6, 0, 0, 0, i % 200]))
    before = served(normal, 7, READ)
    with Attack(flood(low, 64, read)):
        show("64 connections with 32 reads of low priority, same line", before, served(normal, 7, READ))
    with Attack(flood(normal, 64, read)):
        show("64 connections with 32 reads of normal priority, same line", before, served(normal, 7, READ))
    before = served(normal, 17, READ)
    with Attack(flood(normal, 24, lambda i: (11 + i % 4, READ))):
        show("24 connections to a server elsewhere", before, served(normal, 17, READ))
    before = served(normal, 50, bytes([6, 0, 1, 0, 7]))
    with Attack(flood(normal, 40, write)):
        show("40 connections that write to a point", before, served(normal, 50, bytes([6, 0, 1, 0, 7])))
    before = served(small, 50, READ)
    silent = [connect(small) for _ in range(64)]
    show("64 silent connections at max_clients 64", before, served(small, 50, READ))
    for one in silent:
        one.close()
    before = pages(page)
    slow = []
    for _ in range(256):
        one = connect(page)
        one.sendall(f"POST /login HTTP/1.1\r\nHost: 127.0.0.1:{page}\r\nContent-Length: 100\r\n\r\n".encode())
        slow.append(one)
    show("256 logins whose body does not come", before, pages(page))
    for one in slow:
        one.close()


if __name__ == "__main__":
    main()
