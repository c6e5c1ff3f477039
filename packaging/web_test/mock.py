#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Serves the page and answers its requests from samples, without a gateway.

usage: mock.py [--port 8502] [--points 10000] [--token WORD] [--no-acknowledge] [--no-history]

For tests only: POST /mock/kill?device=LINE.DEVICE, /mock/alarm?device=LINE.DEVICE&text=TEXT, /mock/hang (no stream
says anything for five seconds), /mock/reload (all streams end as at a reload); GET /mock/viewers (how many streams are open).
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

from mock_gateway import Gateway

PAGE = pathlib.Path(__file__).resolve().parents[2] / "gateway/outputs/web/page"
DYGRAPHS = pathlib.Path("/usr/share/javascript/dygraphs")
TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


@functools.lru_cache
def packed(file, changed):
    return gzip.compress(file.read_bytes())


def asset(path):
    if path == "/":
        return PAGE / "index.html"
    if path in ("/chart.js", "/chart.css"):
        return DYGRAPHS / ("dygraph.min" + path[6:])
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
            given = json.loads(body).get("token") if body.startswith(b"{") else None
            if given != self.options.token:
                return self.problem(401, "Unauthorized", "wrong token; enter the token of this gateway")
            return self.no_content({"Set-Cookie": "session=mock; HttpOnly; SameSite=Strict"})
        if url.path == "/logout":
            return self.no_content({"Set-Cookie": "session=; Max-Age=0"})
        if not self.logged_in():
            return self.problem(401, "Unauthorized", "Log in first.")
        if url.path == "/api/v1/alarms/ack":
            if self.options.no_acknowledge:
                return self.problem(403, "Forbidden", "The page may not acknowledge: web.acknowledge is deny.")
            count = self.gateway.acknowledge(json.loads(body)["target"])
            self.streams.alarms()
            return self.answer({"acknowledged": count, "trouble": ""})
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
        if url.path == "/mock/hang":
            self.streams.hang_until = time.time() + 5
            return self.no_content()
        self.problem(404, "Not found", "There is no such address.")

    def do_GET(self):
        url = urllib.parse.urlsplit(self.path)
        query = dict(urllib.parse.parse_qsl(url.query))
        if url.path == "/mock/viewers":
            return self.answer({"viewers": len(self.streams.viewers)})
        if not url.path.startswith("/api/"):
            file = asset(url.path)
            if file is None:
                return self.problem(404, "Not found", "There is no such page.")
            return self.answer(packed(file, file.stat().st_mtime), TYPES[file.suffix],
                               extra={"Content-Encoding": "gzip", "Cache-Control": "no-cache"})
        name = url.path.removeprefix("/api/v1/").replace("/", "_").replace(".", "_")
        if name == "session":
            return self.answer({"needs_token": bool(self.options.token), "logged_in": self.logged_in(),
                                "acknowledge": not self.options.no_acknowledge, "gateway": "substation-7",
                                "version": "0.1.0", "history": not self.options.no_history, "events": True})
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

    def get_events(self, query):
        after, target = int(query.get("after", 0)), query.get("target", "")
        since = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(int(query.get("since_ms", 0)) / 1000))
        found = [e for e in self.gateway.events
                 if e["seq"] > after and e["device_time"] >= since
                 and (not target or target in (f"{e['line']}.{e['device']}", e["device"]))]
        page = found[:200]
        return {"records": page, "next": page[-1]["seq"] if page else after, "more": len(found) > 200}

    def get_alarms(self, query):
        return {"records": self.gateway.alarms, "next": 0, "more": False}

    def get_history(self, query):
        found = self.gateway.history(query["point"], int(query["since_ms"]), int(query["until_ms"]),
                                     int(query.get("pixels", 1200)))
        return found or self.problem(404, "Not found", f"Values of {query['point']} are not recorded.")

    def get_history_csv(self, query):
        self.answer(b"time,point,value,quality\n", "text/csv")

    def get_map(self, query):
        return self.gateway.map_of(query["device"])

    def get_recorded(self, query):
        return self.gateway.recorded(query["line"], query.get("device", ""))

    def get_configuration(self, query):
        text = "gateway: { name: substation-7 }\nweb: { listen: 127.0.0.1:8502, token: \"**\" }\nlines:\n" + "".join(
            f"  - name: {line['name']}\n    port: {line['port']}\n    protocol: {line['protocol']}\n    devices:\n"
            + "".join(f"      - {{ name: {d['name']}, address: {d['address']}, profile: {d['profile']} }}\n"
                      for d in line["devices"]) for line in self.gateway.status["lines"][:6])
        return {"text": text, "file": "/etc/baudgate/baudgate.yaml", "confirm_until": None}

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
    parser.add_argument("--no-acknowledge", action="store_true")
    parser.add_argument("--no-history", action="store_true")
    Handler.options = parser.parse_args()
    Handler.gateway = Gateway(Handler.options.points)
    Handler.streams = Streams(Handler.gateway)
    server = Server(("127.0.0.1", Handler.options.port), Handler)
    print(f"http://127.0.0.1:{server.server_port}/", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
