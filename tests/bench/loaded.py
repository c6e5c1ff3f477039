#!/usr/bin/env python3
"""Memory and time of a large configuration: 1,000 lines on tcp:// with 100 points each, once by a
profile and once with the points written at every device. `packaging/bench.sh loaded`.
usage: loaded.py BUILD_FOLDER
SPDX-License-Identifier: Apache-2.0"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

LINES = 1000
POINTS = 100
REST = 15  # seconds after the start
POINT = "{{ name: point_{0}, read: holding {0}, type: uint16, modbus: {0} }}"


def configuration(folder, inline):
    points = "".join(f"\n          - {POINT.format(i)}" for i in range(POINTS))
    text = [f"gateway: {{ name: large, state: {folder}/state, socket: {folder}/control }}",
            "modbus: { listen: [127.0.0.1:28503] }", "dds: { enabled: false }", "lines:"]
    for line in range(LINES):
        unit = line % 247 + 1
        text.append(f"  - name: line-{line}\n    port: tcp://127.0.0.1:{20000 + line}\n    protocol: modbus_rtu\n"
                    f"    devices:\n      - name: slave-{line}\n        address: 1")
        if line < 247:
            text.append(f"        unit: {unit}")
        text.append(f"        points:{points}" if inline else f"        profile: {folder}/hundred.yaml")
    path = folder / ("inline.yaml" if inline else "profile.yaml")
    path.write_text("\n".join(text) + "\n")
    return path


def status(pid, key):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(key + ":"):
            return int(line.split()[1]) / 1024
    raise KeyError(key)


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve() / "baudgate")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        profile = "device: A slave of the bench\npoints:\n" + "".join(
            f"  - {POINT.format(i)}\n" for i in range(POINTS))
        (folder / "hundred.yaml").write_text(profile)
        print("| points | file | checked in | at rest | peak |\n| --- | --- | --- | --- | --- |")
        for inline in (False, True):
            path = configuration(folder, inline)
            begun = time.monotonic()
            check = subprocess.run([binary, "check", "-c", path], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
            took = time.monotonic() - begun
            if check.returncode != 0:
                sys.exit("the configuration is not accepted:\n" + check.stderr[:500])
            with open(os.devnull, "w") as nowhere:
                gateway = subprocess.Popen([binary, "run", "-c", path], stderr=nowhere)
            time.sleep(REST)
            rest, peak = status(gateway.pid, "VmRSS"), status(gateway.pid, "VmHWM")
            gateway.send_signal(signal.SIGTERM)
            if gateway.wait(30) != 0:
                sys.exit("the gateway failed")
            print(f"| {'at every device' if inline else 'by profile'} | {path.stat().st_size / 1e6:.1f} MB "
                  f"| {took:.1f} s | {rest:.0f} MiB | {peak:.0f} MiB |", flush=True)


main()
