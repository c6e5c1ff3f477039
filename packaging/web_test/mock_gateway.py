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
    "drives": [("pump-1", "panel.incomer", "lent"), ("pump-2", "panel.incomer", "lent")],
}

# Keys of points in profile and configuration, by the begin of the points' names; the first row that fits counts.
POINTS = [
    ("reset_", {"write_only": True, "select": True}),
    ("test_", {"write_only": True}),
    ("current_l1", {"precision": 3, "group": "fast", "kept": True, "events": [{"on": "above", "value": 5.4, "alarm": "medium"}]}),
    ("current_", {"precision": 3, "group": "fast", "kept": True}),
    ("voltage_l1", {"precision": 1, "group": "fast", "kept": True, "events": [
        {"on": "below", "value": 207, "alarm": "medium"}, {"on": "above", "value": 253, "alarm": "high"}]}),
    ("voltage_", {"precision": 1, "group": "fast", "kept": True}),
    ("frequency", {"precision": 2, "group": "fast", "kept": True, "min": 45, "max": 65}),
    ("energy_", {"precision": 1, "group": "slow", "kept": True}),
    ("input_", {"group": "fast", "kept": True}),
    ("setting_group", {"group": "slow", "states": {"0": "main", "1": "second"}, "select": True, "writable": True}),
    ("module_status", {"group": "slow", "states": {"0": "normal", "1": "automatic reset", "2": "event register overflow"}}),
    ("active_phase_low_current", {"group": "slow", "precision": 2, "min": 0.5, "max": 5, "step": 0.1, "writable": True}),
    ("active_power", {"precision": 0, "group": "fast", "kept": True}),
    ("active_", {"group": "slow"}),
    ("main_", {"group": "once"}),
    ("second_", {"group": "once"}),
    ("record", {"group": "daily"}),
    ("", {"group": "fast"}),
]
WORST_FIRST = ("high", "medium", "low")
MAINTENANCE = {"disabled": "in maintenance: disabled", "lent": "in maintenance: port lent"}


def shown(value, extra):
    """The text of a value, as the gateway writes it."""
    if value is None:
        return ""
    if "states" in extra and str(int(value)) in extra["states"]:
        return extra["states"][str(int(value))]
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, float):
        return str(value)
    if "precision" in extra:
        return f"{value:.{extra['precision']}f}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}" if value else "0.000"


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
    if wrong in ("no_port", "disabled", "lent"):
        return None
    if wrong == "silent":
        return None if n < 58 else 0
    return 0.6 if wrong == "noisy" and n in (20, 21, 47) else 1


class Point:
    def __init__(self, ident, line, device, row, wrong):
        (self.name, self.value, self.unit, self.quality, self.quality_text, self.type, self.access,
         self.description, self.table, self.address, self.count) = row
        self.id, self.line, self.device = ident, line, device
        self.extra = next(extra for begin, extra in POINTS if self.name.startswith(begin))
        self.write_only = self.extra.get("write_only", False)
        writable = f"{line}.{device}" == "bay-1.feeder-1" and (self.write_only or self.extra.get("writable"))
        self.access = ("write" if writable else "none") if self.write_only else "read_write" if writable else "read"
        if self.value is None and not self.write_only and self.type.startswith(("float", "int", "uint")):
            self.value = round(random.uniform(1, 90), 2)
        if self.quality in (8, 24, 28, 64):
            self.quality, self.quality_text = 192, "good"
        self.base = self.value if isinstance(self.value, (int, float)) else 0
        self.read_at = None if self.quality == 32 else time.time()
        if self.write_only:
            self.value, self.quality, self.quality_text = None, 32, "write only"
        else:
            self.mark(wrong)

    def mark(self, wrong):
        if wrong in ("silent", "killed"):
            self.quality, self.quality_text = 24, "bad: communication failure"
        elif wrong == "no_port":
            self.quality, self.quality_text = 8, "bad: not connected"
        elif wrong in ("disabled", "lent"):
            self.quality, self.quality_text = 28, "bad: out of service"
        elif wrong == "sensor" and self.name == "input_3":
            self.quality, self.quality_text, self.value = 784, "bad: sensor failure, open sensor", None
        if wrong in ("silent", "no_port", "disabled", "lent"):
            self.value = self.read_at = None

    def read(self, now):
        self.read_at = now
        if isinstance(self.value, float) and self.access == "read":
            swing = math.sin(now / 40 + self.id) * 0.03 + random.uniform(-0.004, 0.004)
            self.value = round(self.base * (1 + swing), 4)

    def change(self):
        return [self.id, self.value, self.quality, self.quality_text,
                None if self.read_at is None else int(self.read_at * 1000), shown(self.value, self.extra)]

    def described(self, now):
        told = {key: self.extra[key] for key in ("write_only", "precision", "states", "group", "select", "min", "max", "step",
                                                 "events", "kept") if key in self.extra}
        return {"id": self.id, "line": self.line, "device": self.device, "point": self.name,
                "unit": self.unit, "type": self.type, "description": self.description,
                "access": self.access, "value": self.value, "shown": shown(self.value, self.extra),
                "quality": self.quality, "quality_text": self.quality_text,
                "age_ms": None if self.read_at is None else int((now - self.read_at) * 1000), **told}


class Gateway:
    def __init__(self, points=0, uptime=60):
        self.lock = threading.Lock()
        self.started = time.time() - uptime
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
            event["seq"], event["priority"] = n + 1, "none"
            event["receive_time"] = event["device_time"] = iso(start + n * 11)
            self.events.append(event)
        self.alarms = [{**alarm, "unacknowledged": True} for alarm in copy.deepcopy(SAMPLES["alarms"])]
        self.raise_alarm("", "127.0.0.1:1", "server 127.0.0.1:1 cannot be reached: Connection refused", "low", "", "server away", 6000)
        self.raise_alarm("spare", "", "port down: no such port /dev/ttyUSB4; plug the adapter in, or correct port", "medium", "",
                         "port down", 7000)
        self.raise_alarm("bay-1", "feeder-2", "has never answered", "medium", "", "no answer", 5200)
        self.raise_alarm("io", "ai-1", "input_3 none: open sensor", "low", "input_3", "input_3 sensor", 4000)
        self.alarms[-1].update(state="acknowledged", acknowledged_by="operator at 10.0.0.5", unacknowledged=False)
        self.raise_alarm("bay-2", "transformer-1", "temperature 91.2 °C: above 90", "medium", "temperature",
                         "temperature above 90", 2500)
        self.alarms[-1]["state"] = "returned"
        self.raise_alarm("bay-1", "feeder-1", "stage I> tripped", "high", "", "tripped", 900)
        self.trial_until = 0

    def make_line(self, lines, name, devices):
        line = copy.deepcopy(lines.get(name, lines["bay-1"]))
        line["name"], line["devices"], line["advice"], line["maintenance"] = name, [], [], None
        line["services"] = []
        if name not in lines:
            line["port"] = f"/dev/serial/by-id/usb-{name}"
            line["port_text"] = f"serial {line['port']} 9600 7E1"
        if name == "io":
            line.update(port_state="open", port_text="serial /dev/ttyUSB2 115200 8N1", use=0.37)
        if name == "spare":
            line["advice"] = ["port closed for 2 h: no such port /dev/ttyUSB4; plug the adapter in, or correct port"]
        if name == "drives":
            until = iso(time.time() + 1500)
            line.update(port_state="released", released_until=until, maintenance="lent", use=0.0,
                        advice=[f"released: the port is lent until {until}"])
        for number, (device, sample, wrong) in enumerate(devices):
            made = copy.deepcopy(sample_of(sample))
            made.update(name=device, address=str(number + 1), advice=[], trouble="")
            self.wrong[f"{name}.{device}"] = wrong
            for row in SAMPLES["values"][sample]:
                self.points.append(Point(len(self.points), name, device, row, wrong))
            made["state"], made["last_outcome"], made["last_reason"] = "online", "ok", ""
            made["maintenance"], made["points"], made["disabled"] = wrong if wrong in MAINTENANCE else None, {}, None
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
            if wrong == "lent":
                made.update(state="offline", age_ms=1400000)
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

    def add_event(self, line, device, code, state, text, priority="none"):
        now = iso(time.time())
        self.events.append({"seq": len(self.events) + 1, "receive_time": now, "device_time": now,
                            "clock_quality": 1, "line": line, "device": device, "channel": 0, "code": code,
                            "state": state, "priority": priority, "text": text})

    def raise_alarm(self, line, device, text, priority="high", point="", name="", ago=0):
        self.add_event(line, device, 3, "on", text, priority)
        if ago:
            self.events[-1]["receive_time"] = self.events[-1]["device_time"] = iso(time.time() - ago)
        at = iso(time.time() - ago)
        self.alarms.append({"seq": len(self.events), "state": "active", "priority": priority, "line": line,
                            "device": device, "point": point, "name": name or text, "raised": at, "changed": at,
                            "text": text, "acknowledged_by": "", "unacknowledged": True})

    def acknowledge(self, given):
        """given: the body of the request, with target, line or seq."""
        count, target = 0, given.get("target")
        with self.lock:
            for alarm in list(self.alarms):
                device = f"{alarm['line']}.{alarm['device']}"
                meant = (alarm["seq"] in given.get("seq", []) or alarm["line"] == given.get("line", "-")
                         or target in (str(alarm["seq"]), device, f"{device}.{alarm['point']}"))
                if meant and alarm["unacknowledged"]:
                    count += 1
                    if alarm["state"] == "returned":
                        self.alarms.remove(alarm)
                    alarm.update(state="acknowledged", acknowledged_by="the page", unacknowledged=False, changed=iso(time.time()))
        return count

    def alarm_summary(self):
        with self.lock:
            first = sorted(self.alarms, key=lambda a: (not a["unacknowledged"], a["state"] == "returned",
                                                       WORST_FIRST.index(a["priority"]), -a["seq"]))
            return {"active": sum(a["state"] != "returned" for a in self.alarms),
                    "unacknowledged": sum(a["unacknowledged"] for a in self.alarms), "worst": first[0] if first else None}

    def find(self, name):
        """(line, device) of LINE.DEVICE in the status."""
        for line in self.status["lines"]:
            for device in line["devices"]:
                if f"{line['name']}.{device['name']}" == name:
                    return line, device
        return None

    def set_in_use(self, name, on):
        """Enables or disables a device; returns the changes."""
        _, device = self.find(name)
        device.update(state="online" if on else "disabled", maintenance=None if on else "disabled", age_ms=1 if on else None,
                      advice=[] if on else ["disabled at run time"],
                      disabled=None if on else {"by": "web:anna@10.0.0.7", "since": iso(time.time())})
        changed = []
        with self.lock:
            for point in self.points:
                if f"{point.line}.{point.device}" == name and not point.write_only:
                    if on:
                        point.quality, point.quality_text, point.value = 192, "good", point.base
                        point.read(time.time())
                    else:
                        point.mark("disabled")
                    changed.append(point.change())
        self.add_event(*name.split("."), 1000010, "off" if on else "on", "in use again" if on else "disabled by anna")
        return changed

    def end_loan(self, name):
        line = next(one for one in self.status["lines"] if one["name"] == name)
        line.update(port_state="open", released_until=None, maintenance=None, advice=[])
        for device in line["devices"]:
            self.set_in_use(f"{name}.{device['name']}", True)

    def write(self, given):
        """The answer to a write; the value becomes that of the point."""
        point = next((p for p in self.points if f"{p.line}.{p.device}.{p.name}" == given["point"]), None)
        if point is None:
            return None
        result = {"end": "ok", "reason": "", "read_back": not point.write_only}
        if "expect" in given and given["expect"] != point.value:
            return {"end": "denied", "reason": "the value has changed meanwhile", "read_back": False, "needs": "expect"}
        value = int(given["value"]) if isinstance(given["value"], str) else given["value"]
        if not isinstance(value, bool) and not point.extra.get("min", value) <= value <= point.extra.get("max", value):
            return {"end": "denied", "reason": f"{value} is not within {point.extra['min']} … {point.extra['max']}", "read_back": False}
        if point.extra.get("select") and not given.get("confirm"):
            return {"end": "denied", "reason": "the point was not selected", "read_back": False}
        if not point.write_only:
            point.value = point.base = value
        return result

    def status_of(self, target=""):
        now = time.time()
        status = copy.deepcopy(self.status)
        status["time"], status["uptime_ms"] = iso(now), int((now - self.started) * 1000)
        summary = self.alarm_summary()
        status["events"]["newest"] = len(self.events)
        left = int((self.trial_until - now) * 1000)
        status["configuration"].update(confirm_until=iso(self.trial_until) if left > 0 else None,
                                       confirm_left_ms=left if left > 0 else None)
        status["events"]["alarms"] = {k: summary[k] for k in ("active", "unacknowledged")}
        line_name, _, device_name = target.partition(".")
        for line in status["lines"]:
            line["busy_ms"] = int((now - self.started) * 1000 * line["use"])
            for n, device in enumerate(line["devices"]):
                name = f"{line['name']}.{device['name']}"
                device["busy_ms"] = int((now - self.started) * 1000 * (0.12 - 0.012 * n))
                if device["age_ms"] is not None:
                    device["age_ms"] = int(now * 1000) % 900
                if name in self.killed:
                    ago = now - self.killed[name]
                    device.update(state="offline", age_ms=int(ago * 1000), last_outcome="no_reply")
                    device["advice"] = [f"offline for {ago:.0f} s: not a byte comes any more. Check its power and "
                                        "its wire", "the gateway notices its return within 61 s"]
                mine = [p for p in self.points if p.line == line["name"] and p.device == device["name"]]
                read = [p for p in mine if not p.write_only and not device["maintenance"]]
                good = sum(p.quality == 192 for p in read)
                only = sum(p.write_only for p in mine)
                device["state_text"] = MAINTENANCE.get(device["maintenance"], device["state"])
                device["points"] = {"count": len(read), "good": good, "uncertain": 0, "bad": len(read) - good, "write_only": only,
                                    "maintenance": len(mine) - only if device["maintenance"] else 0}
                if target == name:
                    device["values"] = [{k: p.described(now)[k] if k != "point" else p.name
                                         for k in ("point", "value", "shown", "unit", "quality", "quality_text", "age_ms")}
                                        for p in mine]
        if target:
            status["lines"] = [one for one in status["lines"] if one["name"] == line_name]
            if device_name:
                for one in status["lines"]:
                    one["devices"] = [d for d in one["devices"] if d["name"] == device_name]
            if not status["lines"] or (device_name and not status["lines"][0]["devices"]):
                return None
        status["sums"] = self.sums(status)
        return status

    @staticmethod
    def sums(status):
        devices = [d for line in status["lines"] for d in line["devices"]]
        keys = ("count", "good", "uncertain", "bad", "write_only", "maintenance")
        states = {"count": len(devices), "maintenance": sum(bool(d["maintenance"]) for d in devices)}
        for state in ("online", "degraded", "offline", "never seen"):
            states[state.replace(" ", "_")] = sum(d["state"] == state and not d["maintenance"] for d in devices)
        return {"devices": states, "points": {key: sum(d["points"][key] for d in devices) for key in keys}}

    def map_of(self, name):
        mine = [p for p in self.points if f"{p.line}.{p.device}" == name]
        return {"unit": 1, "registers": [
            {"point": p.name, "table": "discrete" if p.table == "bits" else "input", "address": p.address, "count": p.count,
             "type": p.type, "unit": p.unit, "access": p.access, "plc": str(30001 + p.address),
             "read_functions": [2] if p.table == "bits" else [4, 3],
             "write_functions": [6, 16] if p.access in ("write", "read_write") else []} for p in mine if p.table is not None]}

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
        begin = (time.time() - 400 * 86400) * 1000  # the day on which the history begins
        for t in range(since - since % step, until if until > begin else 0, step):
            if 0.30 < (t - since) / (until - since) < 0.34:
                continue
            mean = base * (1 + 0.3 * math.sin(t / (until - since) * 19 + point.id) + 0.04 * math.sin(t / step / 3))
            spread = base * 0.06 * (1 + math.sin(t / step / 50))
            good = 0.4 if 0.7 < (t - since) / (until - since) < 0.73 else 1
            rows.append([t, round(mean - spread, 4), round(mean, 4), round(mean + spread, 4), good])
        return {"point": name, "unit": point.unit, "step_ms": step, "rows": rows}
