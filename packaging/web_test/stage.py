# SPDX-License-Identifier: Apache-2.0
"""What the page is tested against: the mock server, a gateway of the test's own with twins, or one that runs somewhere."""

import http.client
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

HERE = pathlib.Path(__file__).resolve().parent
TOKEN = "a-token-of-the-test-0123456789"


class LeftOut(Exception):
    """A test cannot be done here; the text says why."""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def end(process):
    process.kill()
    process.wait()


class Proxy(ThreadingHTTPServer):
    """Shows the page at `url` below a path, as `location /plant/gate/ { proxy_pass URL/; }` of nginx does."""

    PATH = "/plant/gate"

    class Handler(BaseHTTPRequestHandler):
        def answer(self):
            path = self.path.removeprefix(self.server.PATH)
            if path == self.path or not path.startswith("/"):
                return self.send_error(404)
            behind = http.client.HTTPConnection(self.server.target, timeout=60)
            length = int(self.headers.get("Content-Length", 0))
            behind.request(self.command, path, self.rfile.read(length), dict(self.headers))
            reply = behind.getresponse()
            self.send_response(reply.status)
            for name, value in reply.getheaders():
                if name.lower() not in ("connection", "transfer-encoding", "date", "server"):
                    self.send_header(name, value)
            self.end_headers()
            try:
                while data := reply.read1(65536):
                    self.wfile.write(data)
            except OSError:
                pass  # the browser has left
            behind.close()
            return None

        do_GET = do_POST = answer

        def log_message(self, *_):
            pass

    def __init__(self, url):
        super().__init__(("127.0.0.1", 0), self.Handler)
        self.daemon_threads = True
        self.target = urllib.parse.urlsplit(url).netloc
        self.url = f"http://127.0.0.1:{self.server_port}{self.PATH}"
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def end(self):
        self.shutdown()
        self.server_close()


class Remote:
    """A gateway that runs somewhere: it can only be looked at."""

    def __init__(self, url, device):
        self.url, self.device, self.trends = url, device, []

    def another(self, **_):
        raise LeftOut("this needs the mock server, or a gateway of the test's own")

    kill = viewers = another
    unkept = ""


class Mock:
    """The mock server as a process of its own."""

    device, victim, unkept, trends = "bay-1.feeder-1", "panel.meter-5", "bay-1.feeder-1.none", [
        "io.ai-4.input_1", "io.ai-4.input_2", "panel.incomer.voltage_l1", "panel.incomer.current_l1"]
    ALARM = "breaker <img src=x onerror=alert(1)> tripped"

    def __init__(self, points=0, token="", acknowledge=True, history=True, **more):
        port = free_port()
        self.url = f"http://127.0.0.1:{port}"
        self.command = [sys.executable, HERE / "mock.py", "--port", str(port), "--points", str(points), "--token", token]
        self.command += [] if acknowledge else ["--no-acknowledge"]
        self.command += [] if history else ["--no-history"]
        self.command += ["--role", more["role"]] if "role" in more else []
        self.command += ["--uptime", str(more["uptime"])] if "uptime" in more else []
        self.command += ["--no-events"] if more.get("events") is False else []
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE)
        self.process.stdout.readline()

    def stop(self):
        end(self.process)
        self.process.stdout.close()

    end = stop

    def post(self, path, **query):
        address = f"{self.url}{path}?{urllib.parse.urlencode(query)}"
        urllib.request.urlopen(urllib.request.Request(address, data=b"", method="POST")).close()

    def kill(self):
        self.post("/mock/kill", device=self.victim)

    def alarm(self):
        """Raises one; a part of its text."""
        self.post("/mock/alarm", device="bay-2.feeder-11", text=self.ALARM)
        return self.ALARM

    def hang(self):
        self.post("/mock/hang")

    def reload(self):
        self.post("/mock/reload")

    def viewers(self):
        with urllib.request.urlopen(self.url + "/mock/viewers") as answer:
            return json.load(answer)["viewers"]


class Gateway:
    """A gateway with twins on ptys, and one line whose port is not there."""

    device, victim, unkept, trends = "bay-1.feeder-1", "panel.meter-5", "spare.ai-9.input_0", [
        "io.ai-1.input_1", "io.ai-1.input_2", "panel.meter-5.voltage_l1", "panel.meter-5.current_l1"]
    TWINS = {"bay-1": ("spaj140c", "9600 7E1", ""), "io": ("owen-mv110-8a", "115200 8N1", ""),
             "panel": ("generic-meter", "19200 8E1", "modbus_rtu"), "plant": ("generic-meter", "19200 8E1", "modbus_rtu")}
    program = "build/release/baudgate"

    def __init__(self, points=0, token="", acknowledge=True, history=True):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="baudgate-page-"))
        self.port, self.modbus = free_port(), free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.file = self.folder / "baudgate.yaml"
        self.file.write_text(self.configuration(points, token, acknowledge, history))
        self.twins = {line: self.twin(line) for line in self.TWINS}
        try:
            self.start()
        except RuntimeError:
            self.end()
            raise

    def configuration(self, points, token, acknowledge, history):
        web = f"listen: 127.0.0.1:{self.port}, acknowledge: {'allow' if acknowledge else 'deny'}"
        if token:
            file = self.folder / "token"
            file.write_text(token + "\n")
            file.chmod(0o600)
            web += f", token: {{ file: {file} }}"
        device = "{{ name: {}, address: {}, profile: {}, unit: {} }}".format
        line = "  - {{ name: {}, port: {}, serial: {}, protocol: {}, alarms: {{ priority: high, delay: 1s }}, devices: [ {} ] }}\n".format
        at = lambda name: self.folder / name
        text = (f"gateway: {{ name: page-test, socket: {at('gate.sock')} }}\nweb: {{ {web} }}\nevents: {{}}\n"
                f"modbus: {{ listen: [ \"127.0.0.1:{self.modbus}\" ] }}\n")
        text += "history: { points: [ { match: \"spare.*.*\", log: off }, { match: \"*.*.*\" } ] }\n" if history else ""
        text += "lines:\n"
        text += line("bay-1", at("bay-1"), "9600 7E1", "spabus", device("feeder-1", 1, "spaj140c", 1))
        text += line("io", at("io"), "115200 8N1", "dcon", device("ai-1", 1, "owen-mv110-8a", 11))
        text += line("panel", at("panel"), "19200 8E1", "modbus_rtu", device("meter-5", 1, "generic-meter", 21))
        text += line("plant", at("plant"), "19200 8E1", "modbus_rtu", device("meter-6", 1, "generic-meter", 22))
        text += line("spare", at("none"), "9600 8N1", "dcon", device("ai-9", 9, "icpdas-i-7017", 30))
        devices = [device(f"unit-{n}", n + 1, "spaj140c", 40 + n) for n in range(-(-points // 123))]
        for first in range(0, len(devices), 40):
            text += line(f"bay-{10 + first}", at(f"none-{first}"), "9600 7E1", "spabus", ", ".join(devices[first:first + 40]))
        return text

    def twin(self, line):
        profile, serial, protocol = self.TWINS[line]
        words = ["simulate", "--profile", profile, "--address", "1", "--pty", self.folder / line, "--baud", serial]
        return self.run(*words, *(["--protocol", protocol] if protocol else []))

    def run(self, *words):
        state = self.folder / "state"
        state.mkdir(exist_ok=True)
        with open(self.folder / "log", "ab") as log:
            return subprocess.Popen([self.program, *words], stdout=log, stderr=log,
                                    env={**os.environ, "STATE_DIRECTORY": str(state)})

    def start(self):
        self.process = self.run("run", "-c", self.file)
        for _ in range(200):
            try:
                return urllib.request.urlopen(self.url + "/api/v1/session").close()
            except OSError:
                time.sleep(0.05)
        raise RuntimeError("the gateway does not answer:\n" + (self.folder / "log").read_text())

    def stop(self):
        end(self.process)

    def end(self):
        self.stop()
        for twin in self.twins.values():
            end(twin)
        shutil.rmtree(self.folder)

    def kill(self):
        """The device is silent, its port is there."""
        self.twins["panel"].send_signal(signal.SIGSTOP)

    def alarm(self):
        """A port that goes; its link too, as the next pty of the machine may get its number."""
        end(self.twins["plant"])
        (self.folder / "plant").unlink()
        return "plant"

    def hang(self):
        self.process.send_signal(signal.SIGSTOP)
        subprocess.Popen(["sh", "-c", f"sleep 5; kill -CONT {self.process.pid}"])

    def reload(self):
        self.file.write_text(self.file.read_text().replace("serial: 115200 8N1", "serial: 9600 8N1"))
        self.run("reload", "--socket", self.folder / "gate.sock").wait()

    def viewers(self):
        raise LeftOut("only the mock server counts its streams")
