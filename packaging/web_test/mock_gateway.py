# SPDX-License-Identifier: Apache-2.0
"""A gateway made of samples (gateway.json): what the mock server answers, with values that move."""

import copy
import json
import math
import pathlib
import random
import threading
import time

SAMPLES = json.loads((pathlib.Path(__file__).parent / "gateway.json").read_text())

# line: devices as (name, sample, what is wrong with it)
PLAN = {
    "bay-1": [(f"feeder-{n}", "bay-1.feeder-1", "silent" if n == 2 else "") for n in range(1, 7)],
    "bay-2": [("transformer-1", "bay-2.transformer-1", "noisy")]
    + [(f"feeder-{n}", "bay-1.feeder-1", "") for n in range(11, 15)],
    "io": [("ai-1", "io.ai-1", "sensor"), ("ai-2", "io.ai-1", "silent"), ("ai-3", "io.ai-1", "disabled")]
    + [(f"ai-{n}", "io.ai-1", "") for n in range(4, 9)],
    "panel": [("incomer", "panel.incomer", "")]
    + [(f"meter-{n}", "panel.incomer", "late" if n == 3 else "") for n in range(1, 8)],
    "spare": [("ai-9", "io.ai-1", "no_port"), ("ai-10", "io.ai-1", "no_port")],
}


def iso(seconds):
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + ".%03dZ" % (seconds * 1000 % 1000)


def sample_of(name):
    line, device = name.split(".")
    for one in SAMPLES["status"]["lines"]:
        if one["name"] == line:
            return next(d for d in one["devices"] if d["name"] == device)
    raise KeyError(name)


def minute_of(wrong, n):
    """The part of a minute in which a device answered."""
    if wrong in ("no_port", "disabled"):
        return None
    if wrong == "silent":
        return None if n < 58 else 0
    return 0.6 if wrong == "noisy" and n in (20, 21, 47) else 1


class Point:
    def __init__(self, ident, line, device, row, wrong):
        (self.name, self.value, self.unit, self.quality, self.quality_text, self.type, self.access,
         self.description, self.table, self.address, self.count) = row
        self.id, self.line, self.device = ident, line, device
        if self.value is None and self.type.startswith(("float", "int", "uint")):
            self.value = round(random.uniform(1, 90), 2)
        if self.quality in (8, 24, 28, 64):
            self.quality, self.quality_text = 192, "good"
        self.base = self.value if isinstance(self.value, (int, float)) else 0
        self.read_at = None if self.quality == 32 else time.time()
        self.mark(wrong)

    def mark(self, wrong):
        if wrong in ("silent", "killed"):
            self.quality, self.quality_text = 24, "bad: communication failure"
        elif wrong == "no_port":
            self.quality, self.quality_text = 8, "bad: not connected"
        elif wrong == "disabled":
            self.quality, self.quality_text = 28, "bad: out of service"
        elif wrong == "sensor" and self.name == "input_3":
            self.quality, self.quality_text, self.value = 784, "bad: sensor failure, open sensor", None
        if wrong in ("silent", "no_port", "disabled"):
            self.value = self.read_at = None

    def read(self, now):
        self.read_at = now
        if isinstance(self.value, float):
            swing = math.sin(now / 40 + self.id) * 0.03 + random.uniform(-0.004, 0.004)
            self.value = round(self.base * (1 + swing), 4)

    def change(self):
        return [self.id, self.value, self.quality, self.quality_text,
                None if self.read_at is None else int(self.read_at * 1000)]

    def described(self, now):
        return {"id": self.id, "line": self.line, "device": self.device, "point": self.name,
                "unit": self.unit, "type": self.type, "description": self.description,
                "access": "read" if self.access == "r" else "read, write", "value": self.value,
                "quality": self.quality, "quality_text": self.quality_text,
                "age_ms": None if self.read_at is None else int((now - self.read_at) * 1000)}


class Gateway:
    def __init__(self, points=0):
        self.lock = threading.Lock()
        self.started = time.time()
        self.status = copy.deepcopy(SAMPLES["status"])
        self.points, self.killed, self.disabled = [], {}, set()
        self.wrong = {}
        plan = {line: list(devices) for line, devices in PLAN.items()}
        total = sum(len(SAMPLES["values"][s]) for devices in plan.values() for _, s, _ in devices)
        while total < points:
            devices = plan.setdefault(f"bay-{10 + len(plan)}", [])
            while total < points and len(devices) < 20:
                devices.append((f"unit-{len(devices) + 1}", "bay-1.feeder-1", ""))
                total += len(SAMPLES["values"]["bay-1.feeder-1"])
        lines = {one["name"]: one for one in self.status["lines"]}
        self.status["lines"] = [self.make_line(lines, name, plan[name]) for name in plan]
        start = time.time() - 7200
        self.events = []
        for n in range(640):
            event = dict(SAMPLES["events"][n % len(SAMPLES["events"])])
            event["seq"] = n + 1
            event["receive_time"] = event["device_time"] = iso(start + n * 11)
            self.events.append(event)
        self.alarms = copy.deepcopy(SAMPLES["alarms"])
        self.raise_alarm("bay-1", "feeder-1", "stage I> tripped", "high", "", "tripped", 900)
        self.raise_alarm("io", "ai-1", "input_3 none: open sensor", "low", "input_3", "input_3 sensor", 4000)
        self.alarms[-1]["state"], self.alarms[-1]["acknowledged_by"] = "acknowledged", "operator at 10.0.0.5"
        self.raise_alarm("bay-2", "transformer-1", "temperature 91.2 °C: above 90", "medium", "temperature",
                         "temperature above 90", 2500)
        self.alarms[-1]["state"] = "returned"

    def make_line(self, lines, name, devices):
        line = copy.deepcopy(lines.get(name, lines["bay-1"]))
        line["name"], line["devices"], line["advice"] = name, [], []
        if name not in lines:
            line["port"] = f"/dev/serial/by-id/usb-{name}"
            line["port_text"] = f"serial {line['port']} 9600 7E1"
        if name == "io":
            line.update(port_state="open", port_text="serial /dev/ttyUSB2 115200 8N1", use=0.37)
        if name == "spare":
            line["advice"] = ["port closed for 2 h: no such port /dev/ttyUSB4; plug the adapter in, or correct port"]
        for number, (device, sample, wrong) in enumerate(devices):
            made = copy.deepcopy(sample_of(sample))
            made.update(name=device, address=str(number + 1), advice=[], trouble="")
            self.wrong[f"{name}.{device}"] = wrong
            for row in SAMPLES["values"][sample]:
                self.points.append(Point(len(self.points), name, device, row, wrong))
            made["state"], made["last_outcome"], made["last_reason"] = "online", "ok", ""
            made["hour"]["outages"] = 0
            if wrong in ("silent", "no_port"):
                made.update(state="never seen" if wrong == "no_port" else "offline", age_ms=None, last_ok=None,
                            last_outcome="no_reply" if wrong == "silent" else "none")
                made["hour"].update(answered=0, failed=62, availability=0.0)
                made["outcomes"].update(ok=0, no_reply=made["exchanges"])
                made["round_trips"].update(count=0, mean_us=0, p50_us=0, p99_us=0, histogram=[])
            made["hour"]["minutes"] = [minute_of(wrong, n) for n in range(60)]
            if wrong == "silent":
                made["advice"] = [f"has never answered: not a byte came. Check its power and wire, then its address "
                                  f"({number + 1}), bit rate, parity and protocol (9600 7E1, spabus)", f"{devices[0][0]} answers on the same line"]
            if wrong == "disabled":
                made.update(state="disabled", age_ms=None, exchanges=0)
                made["hour"].update(answered=0, failed=0)
                made["round_trips"].update(count=0, mean_us=0, histogram=[])
                made["advice"] = ["disabled in the configuration (enabled: false)"]
            if wrong == "noisy":
                made.update(state="degraded", last_outcome="no_reply", last_reason="no answer came")
                made["advice"] = [
                    "7 of 32 exchanges failed: now and then a request gets no answer. Check for noise, and for a bad wire or plug at its end"]
                made["hour"].update(availability=0.97, outages=2)
            if wrong == "late":
                made["advice"] = ["late: its replies come up to 380 ms after the request (timing.reply: 300 ms). "
                                  "Set timing: { reply: 500ms } in the configuration"]
            if wrong == "sensor":
                made["advice"] = ["1 of 8 points have no good value (1 open sensor; input_3)"]
            line["devices"].append(made)
        return line

    def tick(self):
        """One fifth of the points is read anew; returns the changes."""
        now, changed = time.time(), []
        with self.lock:
            phase = int(now * 5) % 5
            for point in self.points:
                quality = point.quality & 255
                if quality == 192 and point.id % 5 == phase:
                    point.read(now)
                    changed.append(point.change())
        return changed

    def kill(self, name):
        with self.lock:
            self.killed[name] = time.time()
            changed = []
            for point in self.points:
                if f"{point.line}.{point.device}" == name:
                    point.mark("killed")
                    changed.append(point.change())
            line, device = name.split(".")
            self.add_event(line, device, 1000009, "on", "does not answer: no_reply")
            return changed

    def add_event(self, line, device, code, state, text):
        now = iso(time.time())
        self.events.append({"seq": len(self.events) + 1, "receive_time": now, "device_time": now,
                            "clock_quality": 1, "line": line, "device": device, "channel": 0, "code": code,
                            "state": state, "text": text})

    def raise_alarm(self, line, device, text, priority="high", point="", name="", ago=0):
        self.add_event(line, device, 3, "on", text)
        at = iso(time.time() - ago)
        self.alarms.append({"seq": len(self.events), "state": "active", "priority": priority, "line": line,
                            "device": device, "point": point, "name": name or text, "raised": at, "changed": at,
                            "text": text, "acknowledged_by": ""})

    def acknowledge(self, target):
        count = 0
        with self.lock:
            for alarm in list(self.alarms):
                names = (str(alarm["seq"]), f"{alarm['line']}.{alarm['device']}",
                         f"{alarm['line']}.{alarm['device']}.{alarm['point']}")
                if target in names and alarm["state"] in ("active", "returned"):
                    count += 1
                    if alarm["state"] == "returned":
                        self.alarms.remove(alarm)
                    alarm["state"], alarm["acknowledged_by"] = "acknowledged", "the page"
                    alarm["changed"] = iso(time.time())
        return count

    def alarm_summary(self):
        with self.lock:
            unseen = [a for a in self.alarms if a["state"] in ("active", "returned")]
            return {"active": sum(a["state"] != "returned" for a in self.alarms), "unacknowledged": len(unseen),
                    "newest": max(unseen, key=lambda a: a["raised"]) if unseen else None}

    def status_of(self, target=""):
        now = time.time()
        status = copy.deepcopy(self.status)
        status["time"], status["uptime_ms"] = iso(now), int((now - self.started + 60) * 1000)
        summary = self.alarm_summary()
        status["events"]["newest"] = len(self.events)
        status["events"]["alarms"] = {k: summary[k] for k in ("active", "unacknowledged")}
        line_name, _, device_name = target.partition(".")
        for line in status["lines"]:
            line["busy_ms"] = int((now - self.started + 60) * 1000 * line["use"])
            for n, device in enumerate(line["devices"]):
                name = f"{line['name']}.{device['name']}"
                device["busy_ms"] = int((now - self.started + 60) * 1000 * (0.12 - 0.012 * n))
                if device["age_ms"] is not None:
                    device["age_ms"] = int(now * 1000) % 900
                if name in self.killed:
                    ago = now - self.killed[name]
                    device.update(state="offline", age_ms=int(ago * 1000), last_outcome="no_reply")
                    device["advice"] = [f"offline for {ago:.0f} s: not a byte comes any more. Check its power and "
                                        "its wire", "the gateway notices its return within 61 s"]
                mine = [p for p in self.points if p.line == line["name"] and p.device == device["name"]]
                good = sum(p.quality == 192 for p in mine)
                device["points"] = {"count": len(mine), "good": good, "uncertain": 0, "bad": len(mine) - good}
                if target == name:
                    device["values"] = [{k: p.described(now)[k] if k != "point" else p.name
                                         for k in ("point", "value", "unit", "quality", "quality_text", "age_ms")}
                                        for p in mine]
        if target:
            status["lines"] = [one for one in status["lines"] if one["name"] == line_name]
            if device_name:
                for one in status["lines"]:
                    one["devices"] = [d for d in one["devices"] if d["name"] == device_name]
            if not status["lines"] or (device_name and not status["lines"][0]["devices"]):
                return None
        return status

    def map_of(self, name):
        mine = [p for p in self.points if f"{p.line}.{p.device}" == name]
        return {"unit": 1, "registers": [
            {"point": p.name, "table": p.table, "address": p.address, "count": p.count, "type": p.type,
             "unit": p.unit, "access": p.access} for p in mine if p.table is not None]}

    def recorded(self, line, device=""):
        """Of another device than that of the samples none."""
        records = SAMPLES["recorded"].get(line, SAMPLES["recorded"]["bay-1"])
        return {"records": [r for r in records if not device or r.split()[1] == device]}

    def trace_record(self, line, n):
        records = self.recorded(line)["records"] or ["00:00:00.000000 # nothing on the line"]
        clock = time.strftime("%H:%M:%S", time.gmtime()) + ".%06d" % (time.time() % 1 * 1e6)
        return clock + records[n % len(records)][15:]

    def history(self, name, since, until, pixels):
        point = next((p for p in self.points if f"{p.line}.{p.device}.{p.name}" == name), None)
        if point is None:
            return None
        step = max(1000, int((until - since) / max(pixels, 1) / 1000) * 1000)
        rows, base = [], abs(point.base) or 1
        for t in range(since - since % step, until, step):
            if 0.30 < (t - since) / (until - since) < 0.34:
                continue
            mean = base * (1 + 0.3 * math.sin(t / (until - since) * 19 + point.id) + 0.04 * math.sin(t / step / 3))
            spread = base * 0.06 * (1 + math.sin(t / step / 50))
            good = 0.4 if 0.7 < (t - since) / (until - since) < 0.73 else 1
            rows.append([t, round(mean - spread, 4), round(mean, 4), round(mean + spread, 4), good])
        return {"point": name, "unit": point.unit, "step_ms": step, "rows": rows}
