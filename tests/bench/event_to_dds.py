#!/usr/bin/env python3
"""How long an event takes from a relay to a subscriber of DDS: a twin on a pty raises numbered
events, the gateway polls it, keeps them and publishes, `baudgate watch --events` prints them.

usage: event_to_dds.py BUILD [EVENTS]    BUILD: the folder with baudgate; 200 events if not given

Prints the delay from the end of the reply (receive_time) and from the moment when it happened
(device_time), less a poll; how far device_time, rebuilt from the relay's seconds, is from the even
steps in which the events were raised; and what an fsync of a 4 kB write takes in the same folder.
SPDX-License-Identifier: Apache-2.0
"""
import datetime
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

POLL = 0.1
EVERY = 0.23  # not a multiple of the poll
DOMAIN = 77


def since_1970(text):
    return datetime.datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp()


def fsync_seconds(folder, rounds=100):
    path = folder / "fsync"
    times = []
    with open(path, "wb", buffering=0) as file:
        for _ in range(rounds):
            begin = time.monotonic()
            file.write(b"x" * 4096)
            os.fsync(file.fileno())
            times.append(time.monotonic() - begin)
    return times


def show(what, seconds):
    seconds = sorted(seconds)
    p99 = seconds[int(len(seconds) * 0.99)]
    print(f"{what:55} median {statistics.median(seconds) * 1e3:6.1f} ms, "
          f"p99 {p99 * 1e3:6.1f} ms, most {seconds[-1] * 1e3:6.1f} ms")
    return p99


def main():
    program = str(pathlib.Path(sys.argv[1]) / "baudgate")
    wanted = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    with tempfile.TemporaryDirectory(prefix="event_to_dds", dir=".") as name:
        folder = pathlib.Path(name).resolve()
        pty = folder / "relay"
        (folder / "gate.yaml").write_text(f"""\
gateway: {{ name: bench, socket: {folder}/gate.sock, state: {folder}/state }}
modbus: {{ enabled: false }}
dds: {{ domain: {DOMAIN} }}
lines:
  - name: bay
    port: {pty}
    protocol: spabus
    serial: "9600 7E1"
    devices:
      - {{ name: relay, address: 1, profile: spaj140c, poll: {int(POLL * 1000)}ms, events: on }}
""")
        started = [subprocess.Popen(
            [program, "simulate", "--profile", "spaj140c", "--address", "1", "--pty", str(pty),
             "--think", "1ms", "--events", f"every:{int(EVERY * 1000)}ms,numbered"],
            stdout=subprocess.PIPE, text=True)]
        try:
            started[0].stdout.readline()
            watch = subprocess.Popen(
                [program, "watch", "--events", "--json", "--domain", str(DOMAIN)],
                stdout=subprocess.PIPE, text=True)
            started.append(watch)
            started.append(subprocess.Popen([program, "run", "-c", str(folder / "gate.yaml")],
                                            stderr=subprocess.DEVNULL))
            replies, happened, seqs, steps = [], [], [], []
            while len(replies) < wanted:
                line = watch.stdout.readline()
                now = time.time()
                event = json.loads(line)
                seqs.append(event["seq"])
                if event["seq"] <= 20:  # the start: subscribers find the gateway
                    continue
                replies.append(now - since_1970(event["receive_time"]))
                happened.append(now - since_1970(event["device_time"]) - POLL)
                steps.append(since_1970(event["device_time"]) - event["seq"] * EVERY)
        finally:
            for child in reversed(started):
                child.terminate()
                child.wait()
        print(f"{len(seqs)} events, {'each once, in order' if seqs == list(range(1, len(seqs) + 1)) else 'NOT once and in order'}")
        fsync = show("an fsync of 4 kB in this folder", fsync_seconds(folder))
        worst = show("from the end of the reply to the subscriber", replies)
        show("from when it happened to the subscriber, less one poll", happened)
        even = statistics.median(steps)
        show("device_time, from even steps", [abs(step - even) for step in steps])
        print(f"p99 from the reply to the subscriber: {worst / 0.05:.2f} of 50 ms, "
              f"{worst / max(fsync, 1e-6):.1f} fsyncs")


if __name__ == "__main__":
    main()
