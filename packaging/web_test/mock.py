#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Serves the page and answers its requests from samples, without a gateway.

usage: mock.py [--port 8502] [--points 10000] [--token WORD] [--role ROLE] [--no-acknowledge] [--no-history] [--no-events] [--uptime SECONDS]

For tests only: POST /mock/kill?device=LINE.DEVICE, /mock/alarm?device=LINE.DEVICE&text=TEXT, /mock/hang (no stream
says anything for five seconds), /mock/reload (all streams end as at a reload), /mock/trial?s=SECONDS (a configuration on trial);
GET /mock/viewers (how many streams are open), /mock/asked (the requests that act, with their bodies).
"""

import argparse
import functools
import gzip
import json
import pathlib
import queue
import threading
import time
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from mock_gateway import Gateway, iso

PAGE = pathlib.Path(__file__).resolve().parents[2] / "gateway/outputs/web/page"
TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


OWN = ("no answer", "port down", "server away")
MAY = {"viewer": [], "auditor": ["sessions", "writes"], "operator": ["acknowledge", "write", "disable", "release"],
       "engineer": ["acknowledge", "write", "disable", "release", "confirm", "sessions", "end_sessions", "writes"]}
NEEDS = {"/api/v1/alarms/ack": "acknowledge", "/api/v1/write": "write", "/api/v1/devices/disable": "disable",
         "/api/v1/devices/enable": "disable", "/api/v1/lines/release": "release", "/api/v1/reload/confirm": "confirm",
         "/api/v1/reload/revert": "confirm", "/api/v1/sessions/end": "end_sessions"}


@functools.lru_cache
def packed(file, changed):
    return gzip.compress(file.read_bytes())


def asset(path):
    if path == "/":
        return PAGE / "index.html"
    file = (PAGE / path[1:]).resolve()
    return file if file.is_file() and PAGE in file.parents else None


class Streams:
    """Who listens to the points, and the ticker that tells them."""

    def __init__(self, gateway):
        self.gateway, self.viewers, self.lock, self.hang_until = gateway, set(), threading.Lock(), 0
        threading.Thread(target=self.run, daemon=True).start()

    def send(self, event, data):
        frame = f"event: {event}\ndata: {json.dumps(data)}\n\n".encode()
        with self.lock:
            for viewer in self.viewers:
                viewer.put(frame)

    def end(self):
        with self.lock:
            for viewer in self.viewers:
                viewer.put(None)

    def alarms(self):
        self.send("alarms", self.gateway.alarm_summary())

    def changes(self, values):
        self.send("change", {"time_ms": int(time.time() * 1000), "generation": 1, "values": values})

    def run(self):
        n = 0
        while True:
            time.sleep(0.2)
            values = self.gateway.tick()
            if time.time() < self.hang_until:
                continue
            if values:
                self.changes(values)
            n += 1
            if n % 5 == 0:
                self.send("beat", {"time_ms": int(time.time() * 1000)})


class Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        """A browser that leaves in the midst of an answer is no error."""


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *args):
        pass

    def answer(self, body, kind="application/json", status=200, extra=()):
        if not isinstance(body, bytes):
            body = json.dumps(body).encode()
        self.send_response(status)
        for name, value in {**HEADERS, **dict(extra)}.items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def problem(self, status, title, detail):
        self.answer({"type": "about:blank", "title": title, "status": status, "detail": detail},
                    "application/problem+json", status)

    def no_content(self, extra=()):
        self.send_response(204)
        for name, value in dict(extra).items():
            self.send_header(name, value)
        self.end_headers()

    def logged_in(self):
        return not self.options.token or "session=mock" in self.headers.get("Cookie", "")

    def body(self):
        return self.rfile.read(int(self.headers.get("Content-Length") or 0))

    def do_POST(self):
        url = urllib.parse.urlsplit(self.path)
        query = dict(urllib.parse.parse_qsl(url.query))
        body = self.body()
        if url.path == "/login":
            form = json.loads(body) if body.startswith(b"{") else {}
            given = form.get("password") if form.get("user") else form.get("token")
            if given != self.options.token:
                return self.problem(401, "Unauthorized", "wrong token; enter the token of this gateway")
            return self.no_content({"Set-Cookie": "session=mock; HttpOnly; SameSite=Strict"})
        if url.path == "/logout":
            return self.no_content({"Set-Cookie": "session=; Max-Age=0"})
        if not self.logged_in():
            return self.problem(401, "Unauthorized", "Log in first.")
        if url.path in NEEDS:
            if NEEDS[url.path] not in self.may():
                return self.problem(403, "Forbidden", "Your role may not do this.")
            given = json.loads(body)
            self.asked.append([url.path, given])
            return self.act(url.path.removeprefix("/api/v1/"), given)
        if url.path == "/mock/kill":
            self.streams.changes(self.gateway.kill(query["device"]))
            return self.no_content()
        if url.path == "/mock/alarm":
            line, device = query["device"].split(".")
            self.gateway.raise_alarm(line, device, query["text"])
            self.streams.alarms()
            return self.no_content()
        if url.path == "/mock/reload":
            self.streams.send("reload", {})
            self.streams.end()
            return self.no_content()
        if url.path == "/mock/trial":
            self.gateway.trial_until = time.time() + float(query["s"])
            return self.no_content()
        if url.path == "/mock/hang":
            self.streams.hang_until = time.time() + 5
            return self.no_content()
        self.problem(404, "Not found", "There is no such address.")

    def may(self):
        may = MAY[self.options.role] if self.options.role else ["acknowledge"]
        return [what for what in may if what != "acknowledge" or not self.options.no_acknowledge]

    def act(self, what, given):
        if what == "alarms/ack":
            count = self.gateway.acknowledge(given)
            self.streams.alarms()
            return self.answer({"ok": True, "acknowledged": count, "trouble": ""})
        if what == "write":
            answer = self.gateway.write(given)
            return self.answer(answer) if answer else self.problem(404, "Not found", "There is no such point.")
        if what.startswith("devices/"):
            self.streams.changes(self.gateway.set_in_use(given["device"], what == "devices/enable"))
            return self.answer({"ok": True, "in_use": what == "devices/enable", "enabled": True})
        if what == "lines/release":
            self.gateway.end_loan(given["line"])
            return self.answer({"ok": True, "line": given["line"], "was_released": True})
        if what == "sessions/end":
            self.sessions[:] = [one for one in self.sessions if one["id"] != given["id"]]
            return self.no_content()
        left, self.gateway.trial_until = self.gateway.trial_until - time.time(), 0
        return self.answer({"ok": left > 0, "applied": False, "exit": 0, "changes": [], "warnings": [],
                            "text": "" if left > 0 else "no configuration is on trial", "confirm_ms": 0}, status=200 if left > 0 else 409)

    def do_GET(self):
        url = urllib.parse.urlsplit(self.path)
        query = dict(urllib.parse.parse_qsl(url.query))
        if url.path == "/mock/viewers":
            return self.answer({"viewers": len(self.streams.viewers)})
        if url.path == "/mock/asked":
            return self.answer(self.asked)
        if not url.path.startswith("/api/"):
            file = asset(url.path)
            if file is None:
                return self.problem(404, "Not found", "There is no such page.")
            return self.answer(packed(file, file.stat().st_mtime), TYPES[file.suffix],
                               extra={"Content-Encoding": "gzip", "Cache-Control": "no-cache"})
        name = url.path.removeprefix("/api/v1/").replace("/", "_").replace(".", "_")
        if name == "session":
            role = self.options.role
            return self.answer({"needs_token": bool(self.options.token), "users": bool(role), "logged_in": self.logged_in(),
                                "user": "anna" if role else "", "role": role, "may": self.may(), "write": "write" in self.may(),
                                "acknowledge": "acknowledge" in self.may(), "gateway": "substation-7", "version": "0.1.0",
                                "history": not self.options.no_history, "events": not self.options.no_events})
        if not self.logged_in():
            return self.problem(401, "Unauthorized", "Log in first.")
        handler = getattr(self, "get_" + name, None)
        if handler is None:
            return self.problem(404, "Not found", "There is no such address.")
        result = handler(query)
        if result is not None:
            self.answer(result)

    def get_status(self, query):
        found = self.gateway.status_of(query.get("target", ""))
        return found or self.problem(404, "Not found", f"There is no line or device '{query['target']}'.")

    def get_points(self, query):
        now, device = time.time(), query.get("device")
        return {"time": "", "points": [p.described(now) for p in self.gateway.points
                                       if not device or f"{p.line}.{p.device}" == device]}

    def events_for(self, query):
        after, target = int(query.get("after", 0)), query.get("device") or query.get("target", "")
        since = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(int(query.get("since_ms", 0)) / 1000))
        return [e for e in self.gateway.events
                if e["seq"] > after and e["device_time"] >= since
                and (not target or target in (f"{e['line']}.{e['device']}", e["device"]))
                and query.get("kind", e["state"]) == e["state"]
                and query.get("priority", e["priority"]) == e["priority"]
                and query.get("text", "").lower() in e["text"].lower()]

    def get_events(self, query):
        if self.options.no_events:
            return self.problem(503, "Not available", "This gateway stores no events.")
        found = self.events_for(query)
        page = found[:200]
        return {"records": page, "next": page[-1]["seq"] if page else int(query.get("after", 0)), "more": len(found) > 200}

    def get_events_csv(self, query):
        keys = ("seq", "receive_time", "device_time", "line", "device", "channel", "code", "state", "priority", "text")
        rows = ["seq,receive_time_utc,device_time_utc,line,device,channel,code,kind,priority,text"]
        rows += [",".join(str(e[key]) for key in keys) for e in self.events_for(query)]
        self.answer("\n".join(rows).encode(), "text/csv")

    def get_alarms(self, query):
        alarms = [a for a in self.gateway.alarms if not self.options.no_events or a["name"] in OWN]
        return {"records": alarms, "next": 0, "more": False, "worst": self.gateway.alarm_summary()["worst"]}

    def get_writes(self, query):
        names = ("seq", "time", "client", "line", "device", "point", "old", "new", "outcome", "reason", "count")
        rows = [(1, iso(time.time() - 7300), "modbus:10.0.0.7:40312", "bay-1", "feeder-1", "setting_group", 0, 1, "ok", "", 1),
                (2, iso(time.time() - 7200), "web:anna@10.0.0.5", "bay-1", "feeder-1", "active_phase_low_current", 1.0, 9.0, "denied",
                 "9 is above the maximum, 5", 1),
                (3, iso(time.time() - 4000), "web:anna@10.0.0.5", "bay-1", "feeder-1", "active_phase_low_current", 1.0, 2.5, "not_sent", "", 1)]
        return {"records": [dict(zip(names, row)) for row in rows], "next": 3, "more": False}

    def get_sessions(self, query):
        return {"sessions": self.sessions}

    def get_history(self, query):
        found = self.gateway.history(query["point"], int(query["since_ms"]), int(query["until_ms"]),
                                     int(query.get("pixels", 1200)))
        return found or self.problem(404, "Not found", f"Values of {query['point']} are not recorded.")

    def get_history_csv(self, query):
        rows = ["time_utc,point,value,quality,quality_text,shown"]
        for name in query["point"].split(","):
            found = self.gateway.history(name, int(query["since_ms"]), int(query["until_ms"]), 60)
            rows += [f"{row[0]},{name},{row[2]},192,good,{row[2]}" for row in found["rows"]]
        self.answer("\n".join(rows).encode(), "text/csv")

    def get_map(self, query):
        return self.gateway.map_of(query["device"])

    def get_recorded(self, query):
        return self.gateway.recorded(query["line"], query.get("device", ""))

    def get_configuration(self, query):
        text = "gateway: { name: substation-7 }\nweb: { listen: 127.0.0.1:8502, token: \"**\" }\nlines:\n" + "".join(
            f"  - name: {line['name']}\n    port: {line['port']}\n    protocol: {line['protocol']}\n    devices:\n"
            + "".join(f"      - {{ name: {d['name']}, address: {d['address']}, profile: {d['profile']} }}\n"
                      for d in line["devices"]) for line in self.gateway.status["lines"][:6])
        return {"text": text, "file": "/etc/baudgate/baudgate.yaml", **{
            key: self.gateway.status_of()["configuration"][key] for key in ("confirm_until", "confirm_left_ms")}}

    def start_stream(self):
        self.close_connection = True
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()

    def get_points_stream(self, query):
        mine = queue.Queue()
        self.start_stream()
        with self.gateway.lock:
            values = [p.change() for p in self.gateway.points]
        for event, data in (("snapshot", {"time_ms": int(time.time() * 1000), "generation": 1, "values": values}),
                            ("alarms", self.gateway.alarm_summary())):
            mine.put(f"event: {event}\ndata: {json.dumps(data)}\n\n".encode())
        with self.streams.lock:
            self.streams.viewers.add(mine)
        try:
            while (frame := mine.get()) is not None:
                self.wfile.write(frame)
                self.wfile.flush()
        except OSError:
            pass
        finally:
            with self.streams.lock:
                self.streams.viewers.discard(mine)

    def get_trace(self, query):
        self.start_stream()
        try:
            for n in range(100000):
                record = self.gateway.trace_record(query["line"], n)
                self.wfile.write(f"event: record\ndata: {json.dumps({'record': record})}\n\n".encode())
                self.wfile.flush()
                time.sleep(0.05)
        except OSError:
            pass


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=8502)
    parser.add_argument("--points", type=int, default=0)
    parser.add_argument("--token", default="")
    parser.add_argument("--role", default="")
    parser.add_argument("--uptime", type=float, default=60)
    parser.add_argument("--no-acknowledge", action="store_true")
    parser.add_argument("--no-events", action="store_true")
    parser.add_argument("--no-history", action="store_true")
    Handler.options = parser.parse_args()
    Handler.asked = []
    Handler.sessions = [{"id": f"s{n}", "user": user, "role": role, "from": at, "since": iso(time.time() - 4000 * n), "last": iso(time.time() - 9 * n)}
                        for n, (user, role, at) in enumerate((("anna", "engineer", "10.0.0.5"), ("vera", "viewer", "10.0.0.9")), 1)]
    Handler.gateway = Gateway(Handler.options.points, Handler.options.uptime)
    Handler.streams = Streams(Handler.gateway)
    server = Server(("127.0.0.1", Handler.options.port), Handler)
    print(f"http://127.0.0.1:{server.server_port}/", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
