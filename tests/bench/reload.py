#!/usr/bin/env python3
"""What a reload costs those whom it does not concern: a gateway with 50 lines, each a twin on a
pty, is told again and again that one line has another poll, while 49 clients read the others.

usage: reload.py BUILD [LINES] [RELOADS]    BUILD: the folder with baudgate; 50 lines, 30 reloads

Prints how long `baudgate reload` takes until it has answered (beside `baudgate --version`, which
only starts and ends), periods missed and replies lost by the lines that were left alone, and
connections dropped or reads refused by then. Wanted: below 100 ms, nothing, nothing.
SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

PORT = 28502


class Client:
    """Reads two registers of one unit every 20 ms over one connection."""

    def __init__(self, unit):
        self.unit, self.reads, self.failed, self.stop = unit, 0, 0, False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        with socket.create_connection(("127.0.0.1", PORT)) as server:
            server.settimeout(5)
            while not self.stop:
                server.sendall(struct.pack(">HHHBBHH", 1, 0, 6, self.unit, 4, 0, 2))
                try:
                    reply = server.recv(256)
                except OSError:
                    reply = b""
                self.reads += 1
                if len(reply) != 13:
                    self.failed += 1
                    if not reply:
                        return
                time.sleep(0.02)


def configuration(folder, lines, poll_of_last):
    text = f"""\
gateway: {{ name: bench, socket: {folder}/gate.sock, state: {folder}/state }}
modbus: {{ listen: "127.0.0.1:{PORT}" }}
dds: {{ enabled: false }}
lines:
"""
    for unit in range(1, lines + 1):
        poll = poll_of_last if unit == lines else 500
        text += f"""\
  - name: line{unit}
    port: {folder}/pty{unit}
    protocol: dcon
    serial: "115200 8N1"
    devices:
      - {{ name: module{unit}, address: 1, profile: owen-mv110-8a, unit: {unit}, poll: {poll}ms }}
"""
    return text


def main():
    program = str(pathlib.Path(sys.argv[1]) / "baudgate")
    lines = int(sys.argv[2]) if len(sys.argv) > 2 else 50
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 30
    with tempfile.TemporaryDirectory(prefix="reload", dir=".") as name:
        folder = pathlib.Path(name).resolve()
        file = folder / "gate.yaml"
        here = ["--socket", f"{folder}/gate.sock"]

        def timed(words):
            begin = time.monotonic()
            subprocess.run([program, *words], check=True, stdout=subprocess.DEVNULL)
            return time.monotonic() - begin

        def counters():
            status = subprocess.run([program, "status", "--json", *here], check=True,
                                    stdout=subprocess.PIPE)
            devices = [line["devices"][0] for line in json.loads(status.stdout)["lines"][:-1]]
            return (sum(one["missed"] for one in devices),
                    sum(one["exchanges"] - one["outcomes"]["ok"] for one in devices),
                    sum(one["exchanges"] for one in devices))

        file.write_text(configuration(folder, lines, 500))
        started, clients = [], []
        try:
            for unit in range(1, lines + 1):
                started.append(subprocess.Popen(
                    [program, "simulate", "--profile", "owen-mv110-8a", "--address", "1", "--pty",
                     f"{folder}/pty{unit}", "--think", "1ms"], stdout=subprocess.PIPE, text=True))
                started[-1].stdout.readline()
            started.append(subprocess.Popen([program, "run", "-c", str(file)],
                                            stderr=subprocess.DEVNULL))
            time.sleep(10)  # every line is read
            counters()  # or there is no gateway
            clients = [Client(unit) for unit in range(1, lines)]
            time.sleep(1)
            before = counters()
            bare, took = [], []
            for number in range(rounds):
                bare.append(timed(["--version"]))
                file.write_text(configuration(folder, lines, 400 if number % 2 == 0 else 500))
                took.append(timed(["reload", *here]))
                time.sleep(0.3)
            after = counters()
        finally:
            for client in clients:
                client.stop = True
            for client in clients:
                client.thread.join()
            for child in reversed(started):
                child.terminate()
                child.wait()
        print(f"{rounds} reloads of 1 of {lines} lines: median {statistics.median(took) * 1e3:.0f} ms, "
              f"most {max(took) * 1e3:.0f} ms, of 100 ms; baudgate --version "
              f"{statistics.median(bare) * 1e3:.0f} ms, most {max(bare) * 1e3:.0f} ms")
        print(f"the other lines: {after[0] - before[0]} periods missed, {after[1] - before[1]} of "
              f"{after[2] - before[2]} exchanges not answered; their clients: "
              f"{sum(one.failed for one in clients)} of {sum(one.reads for one in clients)} reads refused or dropped")


if __name__ == "__main__":
    main()
