#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a raw session at a served port costs beside socat and ser2net on the same pty, in one run.

usage: port_session.py BUILD_FOLDER
"""
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import tty

ROUNDS = 15       # of each program, in turn; of ser2net, which is slow, three
TRIPS = 2000      # of each round
MEGABYTES = 8     # of each round and direction


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def baudgate(build, pty, port, folder):
    file = os.path.join(folder, "gate.yaml")
    with open(file, "w", encoding="utf-8") as config:
        config.write(f"gateway: {{ name: bench, socket: {folder}/gate.sock }}\n"
                     "modbus: { enabled: false }\ndds: { enabled: false }\n"
                     f"lines: [{{ name: bay, port: {pty}, serial: 115200 8N1, "
                     f'serial_server: {{ at: "127.0.0.1:{port}" }} }}]\n')
    return [os.path.join(build, "baudgate"), "run", "-c", file]


def socat(_build, pty, port, _folder):
    return ["socat", f"tcp-listen:{port},bind=127.0.0.1,nodelay", f"{pty},rawer"]


def ser2net(_build, pty, port, folder):
    file = os.path.join(folder, "ser2net.yaml")
    with open(file, "w", encoding="utf-8") as config:
        config.write(f"connection: &one\n  accepter: tcp(nodelay),127.0.0.1,{port}\n"
                     f"  connector: serialdev,{pty},115200n81,local\n")
    return ["ser2net", "-n", "-u", "-c", file]


def connect(port):
    while True:
        try:
            client = socket.create_connection(("127.0.0.1", port))
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return client
        except ConnectionRefusedError:
            time.sleep(0.02)


def trips(client, device):
    """Microseconds from the client to the device and back, the median."""
    times = []
    for _ in range(TRIPS):
        began = time.perf_counter_ns()
        client.send(b"x")
        os.read(device, 1)
        os.write(device, b"y")
        client.recv(1)
        times.append((time.perf_counter_ns() - began) / 1000)
    return statistics.median(times)


def rate(send, receive, total):
    """Megabytes a second; the sender is a process of its own."""
    child = os.fork()
    if child == 0:
        block = bytes(16384)
        left = total
        while left > 0:
            left -= send(block[:left])
        os._exit(0)
    began = time.perf_counter()
    left = total
    while left > 0:
        left -= len(receive(65536))
    took = time.perf_counter() - began
    os.waitpid(child, 0)
    return total / took / 1e6


def measure(command, port, device):
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
        try:
            with connect(port) as client:
                client.send(b"a")
                os.read(device, 1)
                total = MEGABYTES * 1_000_000
                return (trips(client, device),
                        rate(client.send, lambda most: os.read(device, most), total),
                        rate(lambda block: os.write(device, block), client.recv, total))
        finally:
            program.send_signal(signal.SIGTERM)


def main():
    build = sys.argv[1]
    device, slave = os.openpty()
    tty.setraw(slave)
    pty = os.ttyname(slave)
    folder = tempfile.mkdtemp()
    found = {}
    for round_ in range(ROUNDS):
        for program in (socat, baudgate, ser2net):
            if program is ser2net and round_ >= 3:
                continue
            port = free_port()
            found.setdefault(program.__name__, []).append(
                measure(program(build, pty, port, folder), port, device))
    for name, rows in found.items():
        trip, to_port, from_port = (statistics.median(column) for column in zip(*rows))
        # Beside socat in the same round: the machine may have been busy in another one.
        pairs = list(zip(rows, found["socat"]))
        added = statistics.median((row[0] - socat_row[0]) / 2 for row, socat_row in pairs)
        to_ratio, from_ratio = (statistics.median(row[i] / socat_row[i] for row, socat_row in pairs)
                                for i in (1, 2))
        print(f"{name:9} there and back {trip:6.1f} us, one way {added:+6.1f} us beside socat; "
              f"to the port {to_port:6.1f} MB/s ({to_ratio:.2f}), "
              f"from it {from_port:6.1f} MB/s ({from_ratio:.2f})")


main()
