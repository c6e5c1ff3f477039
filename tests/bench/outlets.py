#!/usr/bin/env python3
"""Processor time and memory of the outlets: 10,000 floats that change every second, from ten Modbus TCP
servers, without an outlet and with MQTT to a real mosquitto. `packaging/bench.sh outlets`.
usage: outlets.py BUILD_FOLDER
SPDX-License-Identifier: Apache-2.0"""

import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

DEVICES, POINTS = 10, 1000
WARM, MEASURED = 5, 20  # seconds
WANTED_CPU, WANTED_RSS = 10, 60


def floats_of(second, cache={}):
    if second not in cache:
        cache.clear()
        cache[second] = struct.pack(f">{POINTS}f", *(second % 10000 + i / 1024 for i in range(POINTS)))
    return cache[second]


def serve(listener):
    """Answers function 3 with floats that change every second."""
    def client(connection):
        with connection:
            while True:
                try:
                    head = connection.recv(12, socket.MSG_WAITALL)
                except OSError:
                    return
                if len(head) < 12:
                    return
                number, _, _, unit, _, address, count = struct.unpack(">HHHBBHH", head)
                floats = floats_of(int(time.time()))[2 * address:2 * (address + count)]
                connection.sendall(struct.pack(">HHHBBB", number, 0, len(floats) + 3, unit, 3, len(floats)) + floats)
    while True:
        threading.Thread(target=client, args=(listener.accept()[0],), daemon=True).start()


def servers():
    ports = []
    for _ in range(DEVICES):
        listener = socket.create_server(("127.0.0.1", 0))
        ports.append(listener.getsockname()[1])
        threading.Thread(target=serve, args=(listener,), daemon=True).start()
    return ports


def configuration(folder, ports, outlet):
    text = [f"gateway: {{ name: bench, state: {folder}/state, socket: {folder}/control }}",
            "modbus: { enabled: false }", "dds: { enabled: false }", *outlet, "lines:"]
    for i, port in enumerate(ports):
        text.append(f"  - name: line-{i}\n    port: tcp://127.0.0.1:{port}\n    protocol: modbus_tcp\n    devices:\n"
                    f"      - {{ name: slave-{i}, address: 1, poll: 1s, profile: {folder}/thousand.yaml }}")
    path = folder / "bench.yaml"
    path.write_text("\n".join(text) + "\n")
    return path


def seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return 0


def measure(binary, folder, ports, outlet):
    path = configuration(folder, ports, outlet)
    with open(folder / "log", "w") as log:
        gateway = subprocess.Popen([binary, "run", "-c", path], stderr=log)
    time.sleep(WARM)

    def values():
        status = json.loads(subprocess.run([binary, "status", "--json", "--socket", f"{folder}/control"],
                                           capture_output=True, text=True).stdout or "{}")
        return (status.get("mqtt") or {}).get("values", 0)
    before, used, begun = values(), seconds(gateway.pid), time.monotonic()
    time.sleep(MEASURED)
    used, took = seconds(gateway.pid) - used, time.monotonic() - begun
    rate, rss = (values() - before) / took, memory(gateway.pid)
    gateway.send_signal(signal.SIGTERM)
    if gateway.wait(30) != 0:
        sys.exit("the gateway failed:\n" + (folder / "log").read_text()[-2000:])
    return 100 * used / took, rss, rate


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve() / "baudgate")
    ports = servers()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "thousand.yaml").write_text("device: A slave of the bench\npoints:\n" + "".join(
            f"  - {{ name: point_{i}, read: holding {2 * i} float32, type: float32 }}\n" for i in range(POINTS)))
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        (folder / "mosquitto.conf").write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\n")
        environment = dict(os.environ, PATH=os.environ["PATH"] + ":/usr/sbin")
        broker = subprocess.Popen(["mosquitto", "-c", folder / "mosquitto.conf"], env=environment,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1)
        try:
            mqtt = [f'mqtt: {{ broker: "mqtt://127.0.0.1:{port}" }}']
            sparkplug = [f'mqtt: {{ broker: "mqtt://127.0.0.1:{port}", payload: sparkplug }}']
            print("| outlet | processor | memory | values a second |\n| --- | --- | --- | --- |")
            bare = measure(binary, folder, ports, [])
            print(f"| none | {bare[0]:.1f} % | {bare[1]:.0f} MiB | |", flush=True)
            for kind, outlet in (("MQTT, JSON", mqtt), ("MQTT, Sparkplug B", sparkplug)):
                cpu, rss, rate = measure(binary, folder, ports, outlet)
                print(f"| {kind} | {cpu:.1f} % (+{cpu - bare[0]:.1f}) | {rss:.0f} MiB | {rate:.0f} |", flush=True)
            print(f"wanted: below {WANTED_CPU} % of a core and {WANTED_RSS} MiB")
        finally:
            broker.kill()


main()
