#!/usr/bin/env python3
"""Runs a gateway with every interface switched on, and uses and disturbs all of them at the same time.

usage: tests/soak/everything.py GATEWAY TWINS [MINUTES]    GATEWAY: `baudgate`, best built with AddressSanitizer; TWINS: `baudgate` of any build

The gateway has TLS on the page, on Modbus and on a served port, users, a security journal, audit, events, history and DDS.
Prints one line about the use of the interfaces, one about memory and descriptors, and a line for each failure. It fails if the
gateway ends early, a sanitizer reports something, memory or descriptors grow from the second quarter of the run to the last, the
audit or the journal has a wrong row, or a device does not answer at the end.
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import json
import os
import pathlib
import random
import shutil
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

GATEWAY, TWINS = (str(pathlib.Path(one).resolve()) for one in sys.argv[1:3])
SECONDS = 60 * float(sys.argv[3]) if len(sys.argv) > 3 else 60
MOST_GROWTH_KB = 16 * 1024
MOST_MORE_DESCRIPTORS = 12
# line: device, profile, serial settings, protocol, further keys of the device
KINDS = {"bay": ("relay", "spaj140c", "38400 7E1", "spabus", ", write: [setting_group, event_mask_phase, event_mask_earth]"),
         "io": ("input", "owen-mv110-8a", "115200 8N1", "dcon", ""),
         "meters": ("energy", "set-4tm.03m", "115200 8O1", "set4tm", ", time_zone: \"+03:00\""),
         "panel": ("meter", "generic-meter", "19200 8E1", "modbus_rtu", ""),
         "drives": ("drive", "mitsubishi-fr-d700", "19200 8E1", "modbus_rtu", ", write: [set_frequency]")}
PORTS = {}


def free_port(name):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        PORTS[name] = probe.getsockname()[1]
        return PORTS[name]


class Plant:
    def __init__(self, folder):
        self.folder = folder
        self.file = folder / "baudgate.yaml"
        self.log = folder / "log"
        (folder / "state").mkdir()
        for kind in ("web", "modbus", "ports"):
            self.ask("certs", kind, str(folder / kind), *(["--name", "localhost"] if kind != "modbus" else []), program=TWINS)
        users = str(folder / "users")
        self.tokens = {}
        for name, role in (("victor", "viewer"), ("otto", "operator"), ("erna", "engineer"), ("audrey", "auditor")):
            self.ask("users", "add", name, "--role", role, "--file", users, program=TWINS, words="secret-of-" + name + "\n")
            self.tokens[name] = self.ask("users", "token", name, "--file", users, program=TWINS).split()[-1]
        self.twins = {line: self.twin(line) for line in KINDS}
        self.file.write_text(self.configuration())

    def configuration(self):
        at = lambda *names: self.folder.joinpath(*names)
        text = f"""gateway: {{ name: soak, socket: {at('gate.sock')} }}
users: {{ file: {at('users')} }}
web: {{ listen: "127.0.0.1:{free_port('web')}", certificate: {at('web', 'gateway.pem')}, key: {at('web', 'gateway.key')} }}
events: {{}}
history: {{ points: [ {{ match: "*.*.*", log: all }} ] }}
dds: {{ enabled: true, domain: 77, interfaces: [127.0.0.1] }}
modbus:
  listen:
    - {{ at: "127.0.0.1:{free_port('plain')}", permit: all }}
    - {{ at: "127.0.0.1:{free_port('low')}", permit: read, priority: low }}
    - at: "127.0.0.1:{free_port('tls')}"
      protocol: tls
      certificate: {at('modbus', 'gateway.pem')}
      key: {at('modbus', 'gateway.key')}
      ca: {at('modbus', 'ca.pem')}
      roles: {{ viewer: read, operator: write }}
  routes: [ {{ units: 30, line: panel }} ]
lines:
"""
        for number, (line, (device, profile, serial, protocol, more)) in enumerate(KINDS.items()):
            text += (f"  - {{ name: {line}, port: {at(line)}, serial: {serial}, protocol: {protocol}, alarms: {{ priority: high, delay: 2s }}, "
                     f"devices: [ {{ name: {device}, address: 1, profile: {profile}, unit: {number + 1}, poll: 200ms{more} }} ] }}\n")
        text += (f"  - {{ name: served, port: {at('io')}-second, serial: 9600 8N1, serial_server: {{ at: \"127.0.0.1:{free_port('served')}\", "
                 f"certificate: {at('ports', 'gateway.pem')}, key: {at('ports', 'gateway.key')} }} }}\n")
        return text

    def environment(self):
        return {**os.environ, "STATE_DIRECTORY": str(self.folder / "state"),
                "ASAN_OPTIONS": "detect_leaks=1:abort_on_error=0", "UBSAN_OPTIONS": "print_stacktrace=1"}

    def ask(self, *words_of_command, program=None, words=None):
        done = subprocess.run([program or TWINS, *words_of_command], input=words, capture_output=True, text=True, env=self.environment(), timeout=60, check=False)
        if program and done.returncode:
            sys.exit(f"{words_of_command}: {done.stderr}")
        return done.stdout

    def spawn(self, *words):
        with open(self.log, "ab") as log:
            return subprocess.Popen(words, stdout=log, stderr=log, env=self.environment())

    def twin(self, line):
        _, profile, serial, protocol, _ = KINDS[line]
        return self.spawn(TWINS, "simulate", "--protocol", protocol, "--profile", profile, "--address", "1", "--pty", str(self.folder / line), "--baud", serial)


class Use(threading.Thread):
    """Repeats one kind of use until the end. An error of the connection is part of the soak, so it is only counted."""

    ended = False
    counts = collections.Counter()

    def __init__(self, act, pause):
        super().__init__(daemon=True)
        self.act, self.pause = act, pause

    def run(self):
        while not Use.ended:
            name = self.act.__name__
            try:
                self.act()
                Use.counts[name] += 1
            except (OSError, ssl.SSLError, urllib.error.URLError, ValueError, struct.error, subprocess.TimeoutExpired):
                Use.counts[name + " failed"] += 1
            time.sleep(self.pause * random.uniform(0.5, 1.5))


def acts(plant):
    """Returns the kinds of use: a function, and the mean pause after it in seconds."""
    trust = ssl.create_default_context(cafile=plant.folder / "web" / "ca.pem")

    def connect(name, timeout=5):
        return socket.create_connection(("127.0.0.1", PORTS[name]), timeout)

    def exchange(one, unit, pdu):
        one.sendall(struct.pack(">HHHB", random.randrange(65536), 0, len(pdu) + 1, unit) + pdu)
        if not one.recv(300):
            raise OSError("closed")

    def modbus_reads():
        with connect(random.choice(["plain", "low"])) as one:
            for _ in range(50):
                exchange(one, random.randint(1, 4), struct.pack(">BHH", random.choice([3, 4]), random.randrange(60), random.randint(1, 20)))

    def modbus_writes():
        with connect("plain") as one:
            exchange(one, random.randint(1, 4), struct.pack(">BHH", 6, random.randrange(300), random.randrange(65536)))

    def routed_reads():
        with connect("plain") as one:
            exchange(one, 30, struct.pack(">BHH", 3, 0, 2))

    def modbus_tls():
        role = random.choice(["viewer", "operator"])
        context = ssl.create_default_context(cafile=plant.folder / "modbus" / "ca.pem")
        context.check_hostname = False
        context.load_cert_chain(plant.folder / "modbus" / f"{role}.pem", plant.folder / "modbus" / f"{role}.key")
        with context.wrap_socket(connect("tls")) as one:
            for _ in range(20):
                exchange(one, random.randint(1, 4), struct.pack(">BHH", random.choice([3, 4, 6]), random.randrange(60), 1))

    def stalled_handshakes():
        held = [connect(random.choice(["tls", "web", "served"])) for _ in range(10)]
        for one in held:
            one.sendall(b"\x16\x03\x01\x02\x00"[:random.randint(0, 5)])
        time.sleep(2)
        for one in held:
            one.close()

    def garbage():
        with connect(random.choice(list(PORTS))) as one:
            one.sendall(os.urandom(random.randint(1, 5000)))

    def page(path, user=None, body=None):
        request = urllib.request.Request(f"https://localhost:{PORTS['web']}{path}", data=body)
        request.add_header("Authorization", "Bearer " + (plant.tokens[user] if user else "wrong"))
        if body is not None:
            request.add_header("Content-Type", "application/json")
        with urllib.request.urlopen(request, timeout=10, context=trust) as answer:
            return answer.read()

    def page_reads():
        page(random.choice(["/api/v1/points", "/api/v1/status", "/api/v1/alarms", "/api/v1/events", "/metrics", "/api/v1/session",
                            f"/api/v1/history?point=panel.meter.voltage_l1&since_ms={int(time.time() * 1000) - 600000}&until_ms={int(time.time() * 1000)}"]), random.choice(list(plant.tokens)))

    def page_writes():
        body = {"point": random.choice(["panel.meter.voltage_l1", "bay.relay.event_mask_phase", "bay.relay.setting_group"]), "value": random.randrange(300)}
        page("/api/v1/write", "otto", json.dumps(body).encode())

    def page_strangers():
        page("/api/v1/points")

    def page_stream():
        request = urllib.request.Request(f"https://localhost:{PORTS['web']}/api/v1/points/stream", headers={"Authorization": "Bearer " + plant.tokens["victor"]})
        with urllib.request.urlopen(request, timeout=10, context=trust) as stream:
            for _ in range(50):
                stream.readline()

    def served_port():
        with trust_ports().wrap_socket(connect("served"), server_hostname="localhost") as one:
            one.sendall(b"hello\r\n")

    def trust_ports():
        return ssl.create_default_context(cafile=plant.folder / "ports" / "ca.pem")

    def commands():
        words = random.choice([["status", "--json"], ["alarms"], ["events"], ["writes"], ["history", "panel.meter.voltage_l1", "--since", "10min"],
                               ["read", "panel.meter"], ["disable", "io.input"], ["enable", "io.input"], ["write", "bay.relay.event_mask_earth", "7"], ["ack", "--all"]])
        plant.ask(*words, "--socket", str(plant.folder / "gate.sock"))

    def reloads():
        if random.random() < 0.5:
            plant.ask("certs", "web", str(plant.folder / "web"), "--name", "localhost")
        text = plant.file.read_text()
        plant.file.write_text(text.replace("poll: 200ms", "poll: 300ms") if "poll: 200ms" in text else text.replace("poll: 300ms", "poll: 200ms"))
        plant.ask("reload", "--socket", str(plant.folder / "gate.sock"))

    def dead_devices():
        line = random.choice(list(KINDS))
        plant.twins[line].kill()
        plant.twins[line].wait()
        time.sleep(random.uniform(0, 10))
        plant.twins[line] = plant.twin(line)

    return [(modbus_reads, 0.2), (modbus_writes, 0.5), (routed_reads, 0.5), (modbus_tls, 0.5), (stalled_handshakes, 5), (garbage, 1), (page_reads, 0.5),
            (page_writes, 1), (page_strangers, 5), (page_stream, 2), (served_port, 2), (commands, 2), (reloads, 60), (dead_devices, 45)]


def held(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in status if "VmRSS" in line), len(os.listdir(f"/proc/{pid}/fd"))


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="baudgate-everything-"))
    plant = Plant(folder)
    gateway = plant.spawn(GATEWAY, "run", "-c", str(plant.file))
    failed, samples = [], []
    time.sleep(10)
    for act, pause in acts(plant):
        Use(act, pause).start()
    end = time.monotonic() + SECONDS
    while time.monotonic() < end and gateway.poll() is None:
        samples.append(held(gateway.pid))
        time.sleep(min(10, SECONDS / 20))
    Use.ended = True
    time.sleep(30)  # dead devices return, connections end
    if gateway.poll() is None:
        state = json.loads(plant.ask("status", "--json", "--socket", str(folder / "gate.sock")))
        failed += [f"{line['name']}.{device['name']} is {device['state']}" for line in state["lines"] for device in line.get("devices", [])
                   if device["state"] not in ("online", "degraded")]
        verified = subprocess.run([TWINS, "audit", "--verify", "-c", str(plant.file)], capture_output=True, text=True, env=plant.environment(), check=False)
        failed += [] if verified.returncode == 0 else ["audit --verify: " + verified.stdout + verified.stderr]
        gateway.terminate()
        try:
            gateway.wait(60)
        except subprocess.TimeoutExpired:
            failed.append("the gateway does not end")
            gateway.kill()
    if gateway.wait():
        failed.append(f"the gateway has ended with {gateway.returncode}")
    for twin in plant.twins.values():
        twin.kill()
    log = plant.log.read_text(errors="replace")
    if "Sanitizer" in log or "runtime error:" in log:
        failed.append("a sanitizer has reported something")
    quarter = max(1, len(samples) // 4)
    first, last = samples[quarter:2 * quarter] or [(0, 0)], samples[-quarter:] or [(0, 0)]
    for what, index, most in (("memory in kB", 0, MOST_GROWTH_KB), ("descriptors", 1, MOST_MORE_DESCRIPTORS)):
        was, now = max(one[index] for one in first), max(one[index] for one in last)
        print(f"{what}: at most {was} in the second quarter of {SECONDS / 60:.0f} minutes, {now} in the last")
        if now > was + most:
            failed.append(f"{what} grew from {was} to {now}")
    print("uses:", ", ".join(f"{name} {count}" for name, count in sorted(Use.counts.items())))
    for one in failed:
        print("FAILED", one)
    if failed:
        print(f"log and configuration: {folder}")
        sys.exit(1)
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
