#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The port of a line over the network, with programs that are not the project's: pyserial's
rfc2217://, socat, mbpoll, and ser2net as the far end where its name is given.

usage: serial_server.py BAUDGATE [PART…]     all parts but ser2net without names
"""
import fcntl
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import tty

import serial
import serial.rfc2217  # noqa: F401  the handler of rfc2217://

BAUDGATE = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else ""
LIMIT = 60  # seconds; only keeps a broken run from hanging


def until(what, condition):
    """Waits for an event; its failure names it."""
    end = time.monotonic() + LIMIT
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError("not in time: " + what)


def equal(what, got, wanted):
    assert got == wanted, f"{what}: {got!r} in place of {wanted!r}"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def crc(frame):
    value = 0xFFFF
    for byte in frame:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)


class Cable:
    """A pty: the gateway has its slave, the test is the device at its other end."""

    def __init__(self):
        self.device, self.keep = os.openpty()
        tty.setraw(self.keep)
        self.port = os.ttyname(self.keep)

    def read(self, count):
        got = b""
        while len(got) < count:
            got += os.read(self.device, count - len(got))
        return got

    def write(self, data):
        while data:
            data = data[os.write(self.device, data):]

    def baud(self):
        """That of struct termios2, because the gateway sets free bit rates."""
        get, size = 0x802C542A, 44  # TCGETS2
        return struct.unpack("I", fcntl.ioctl(self.device, get, bytes(size))[40:])[0]


class Slave:
    """A Modbus RTU slave 1 at a cable whose holding register N has the value 100 + N."""

    def __init__(self, cable):
        self.cable, self.asked = cable, 0
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        held = b""
        while True:
            held += os.read(self.cable.device, 256)
            while len(held) >= 8:
                frame, rest = held[:8], held[8:]
                if crc(frame[:6]) != frame[6:] or frame[0] != 1:
                    held = held[1:]
                    continue
                held = rest
                self.asked += 1
                start, count = struct.unpack(">HH", frame[2:6])
                if frame[1] in (3, 4) and 0 < count <= 125 and start + count < 1000:
                    data = b"".join(struct.pack(">H", 100 + start + i) for i in range(count))
                    reply = bytes([1, frame[1], len(data)]) + data
                else:
                    reply = bytes([1, frame[1] | 0x80, 2])
                self.cable.write(reply + crc(reply))


class Gateway:
    def __init__(self, config):
        self.folder = tempfile.mkdtemp(prefix="serial_server.")
        self.file = os.path.join(self.folder, "gate.yaml")
        self.socket = os.path.join(self.folder, "gate.sock")
        self.listener = free_port()
        with open(self.file, "w", encoding="utf-8") as file:
            file.write(f"gateway: {{ name: gate, state: {self.folder}, socket: {self.socket} }}\n"
                       "dds: { enabled: false }\nevents: {}\n" + config(self))
        self.process = None

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def start(self):
        self.process = subprocess.Popen([BAUDGATE, "run", "-c", self.file],
                                        stdout=subprocess.DEVNULL, stderr=self.log())
        until("the gateway answers", lambda: self.ask("status", "--json").returncode == 0)

    def reload(self, old, new, *words):
        with open(self.file, encoding="utf-8") as file:
            text = file.read()
        assert old in text, old
        with open(self.file, "w", encoding="utf-8") as file:
            file.write(text.replace(old, new))
        done = self.ask("reload", *words)
        equal("reload: " + done.stdout + done.stderr, done.returncode, 0)

    def log(self):
        return open(os.path.join(self.folder, "log"), "a", encoding="utf-8")

    def ask(self, *words):
        return subprocess.run([BAUDGATE, *words, "--socket", self.socket], capture_output=True,
                              text=True, timeout=LIMIT, check=False)

    def line(self, name="bay"):
        status = json.loads(self.ask("status", name, "--json").stdout)
        return status["lines"][0]

    def service(self, name="bay"):
        return self.line(name)["services"][0]

    def point(self, name="bay"):
        # A Modbus client's view: the value, and its quality 20000 behind it.
        with socket.create_connection(("127.0.0.1", self.listener)) as client:
            words = []
            for start in (0, 20000):
                client.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, start, 1))
                reply = client.recv(256)
                words.append(struct.unpack(">H", reply[9:11])[0] if reply[7] == 3 else None)
            return words

    def sockets(self):
        """What clients can leave open; the files of the logs come when a worker opens them."""
        folder = f"/proc/{self.process.pid}/fd"
        held = 0
        for name in os.listdir(folder):
            try:
                held += os.readlink(os.path.join(folder, name)).startswith("socket:")
            except FileNotFoundError:
                pass  # it was closed in between
        return held


def served(cable, port, more=""):
    return (f"modbus: {{ enabled: false }}\n"
            f"lines:\n  - {{ name: bay, port: {cable.port}, serial: 9600 8N1, "
            f'serial_server: {{ at: "127.0.0.1:{port}"{more} }} }}\n')


def polled(cable, more, listener, name="bay", unit=1):
    return (f'modbus: {{ listen: "127.0.0.1:{listener}" }}\n'
            f"lines:\n  - name: {name}\n    port: {cable.port}\n    serial: 19200 8N1\n"
            f"    protocol: modbus_rtu\n    {more}\n    devices:\n"
            f"      - {{ name: pump, address: 1, unit: {unit}, poll: 50ms, points: [ "
            f'{{ name: speed, read: "holding 0", type: uint16, modbus: 0 }} ] }}\n')


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=LIMIT)


def receive(client, count):
    got = b""
    while len(got) < count:
        piece = client.recv(count - len(got))
        assert piece, "the connection ended"
        got += piece
    return got


def is_closed(client):
    """Reads to its end; pieces do not matter."""
    try:
        while client.recv(4096):
            pass
    except ConnectionResetError:
        pass
    return True


def raw():
    cable, port = Cable(), free_port()
    with Gateway(lambda _: served(cable, port)) as gate:
        everything = bytes(range(256)) * 20
        with connect(port) as client:
            client.sendall(everything)
            equal("to the port", cable.read(len(everything)), everything)
            cable.write(everything)
            equal("from the port", receive(client, len(everything)), everything)
            assert is_closed(connect(port)), "the second is refused"
            now = until("status", lambda: gate.service()["client"])
            equal("who", now["client"], "127.0.0.1:%d" % client.getsockname()[1])
        until("it is free again", lambda: gate.service()["last"])
        last = gate.service()["last"]
        equal("bytes", (last["to_port"], last["from_port"]), (len(everything), len(everything)))


def wait():
    cable, port = Cable(), free_port()
    with Gateway(lambda _: served(cable, port, ", busy: wait")):
        first, second = connect(port), connect(port)
        first.sendall(b"one")
        equal("the first", cable.read(3), b"one")
        second.sendall(b"two")
        first.close()
        equal("the second, when its turn has come", cable.read(3), b"two")
        second.close()


def rfc2217():
    cable, port = Cable(), free_port()
    with Gateway(lambda _: served(cable, port, ", mode: rfc2217")):
        url = f"rfc2217://127.0.0.1:{port}"
        with serial.serial_for_url(url, baudrate=19200, timeout=LIMIT) as client:
            equal("baud", cable.baud(), 19200)
            for baud in (1200, 115200, 123456):
                client.baudrate = baud
                equal("baud", cable.baud(), baud)
            for bits in (5, 6, 7, 8):
                client.bytesize = bits
            for parity in (serial.PARITY_EVEN, serial.PARITY_ODD, serial.PARITY_MARK,
                           serial.PARITY_SPACE, serial.PARITY_NONE):
                client.parity = parity
            client.stopbits = serial.STOPBITS_TWO
            assert termios.tcgetattr(cable.device)[2] & termios.CSTOPB
            client.stopbits = serial.STOPBITS_ONE
            client.xonxoff = True
            assert termios.tcgetattr(cable.device)[0] & termios.IXON
            client.xonxoff = False
            client.rtscts = True
            client.rtscts = False
            for on in (False, True):
                client.dtr = on
                client.rts = on
                client.break_condition = not on
            client.send_break(0.01)
            equal("modem lines of a pty", (client.cts, client.dsr, client.ri, client.cd),
                  (False, False, False, False))
            everything = bytes(range(256)) * 4
            client.write(everything)
            equal("to the port", cable.read(len(everything)), everything)
            cable.write(everything)
            equal("from the port", client.read(len(everything)), everything)
            client.reset_input_buffer()
            client.reset_output_buffer()
        for option in ("ign_set_control", "poll_modem", "timeout=9"):
            until("the last client has left", lambda: can_open(url + "?" + option))
        until("its own settings again", lambda: cable.baud() == 9600)


def can_open(url):
    try:
        with serial.serial_for_url(url, timeout=LIMIT) as client:
            return client.cts in (True, False)
    except serial.SerialException:
        return False


def flow():
    cable, port = Cable(), free_port()
    with Gateway(lambda _: served(cable, port).replace(
            "serial: 9600 8N1", "serial: { baud: 9600, xonxoff: true }")) as gate:
        with connect(port) as client:
            client.sendall(b"a")
            equal("without XOFF", cable.read(1), b"a")
            cable.write(b"\x13x")
            equal("behind XOFF", receive(client, 1), b"x")
            client.sendall(b"b")
            until("taken by the gateway", lambda: gate.service()["client"]["to_port"] == 2)
            os.set_blocking(cable.device, False)
            try:
                held = os.read(cable.device, 1)
            except BlockingIOError:
                held = b""
            os.set_blocking(cable.device, True)
            equal("held back", held, b"")
            cable.write(b"\x11")
            equal("behind XON", cable.read(1), b"b")


def lend():
    cable, port = Cable(), free_port()
    slave = Slave(cable)
    more = f'lend: {{ at: "127.0.0.1:{port}", mode: rfc2217, for: 30min }}'
    with Gateway(lambda gate: polled(cable, more, gate.listener)) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        with connect(port) as silent:
            before = slave.asked
            until("polls go on beside a silent client", lambda: slave.asked > before + 5)
            equal("not taken", gate.line()["port_state"], "open")
            silent.close()
        url = f"rfc2217://127.0.0.1:{port}"
        with serial.serial_for_url(url, baudrate=1200, timeout=LIMIT) as client:
            line = until("lent", lambda: lent(gate))
            assert "lent to 127.0.0.1:" in line["port_text"], line["port_text"]
            equal("baud of the client", cable.baud(), 1200)
            equal("out of service", gate.point()[1] in (None, 28), True)
            ask = bytes([1, 3, 0, 7, 0, 1])
            client.write(ask + crc(ask))
            equal("the slave answers the client", client.read(7)[:5], bytes([1, 3, 2, 0, 107]))
        until("polled again", lambda: gate.point() == [100, 192])
        equal("own settings", cable.baud(), 19200)
        records = [json.loads(text) for text in
                   gate.ask("writes", "--json").stdout.splitlines()]
        equal("audit", [(r["kind"], r["point"], r["new"]) for r in records],
              [("loan", "port", "lent"), ("loan", "port", "back")])
        events = gate.ask("events", "--json").stdout
        assert "port lent to another program: 127.0.0.1" in events, events
        assert "bytes to the port" in events, events


def lent(gate):
    line = gate.line()
    return line if line["port_state"] == "released" else None


def by_hand():
    cable, port = Cable(), free_port()
    Slave(cable)
    with Gateway(lambda gate: polled(cable, "", gate.listener)) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        done = gate.ask("release", "bay", "--tcp", f"127.0.0.1:{port}", "--for", "30min")
        equal("release: " + done.stderr, done.returncode, 0)
        with connect(port) as client:
            ask = bytes([1, 3, 0, 1, 0, 1])
            client.sendall(ask + crc(ask))
            equal("answer", receive(client, 7)[:5], bytes([1, 3, 2, 0, 101]))
            equal("taken back", gate.ask("release", "bay", "--end").returncode, 0)
            assert is_closed(client)
        until("polled again", lambda: gate.point() == [100, 192])
        try:
            connect(port).close()
            raise AssertionError("the port is still open")
        except ConnectionRefusedError:
            pass
        # A scan over the network finds the slave, and the line comes back.
        gate.ask("release", "bay", "--tcp", f"127.0.0.1:{port}", "--for", "10min")
        found = subprocess.run([BAUDGATE, "scan", f"tcp://127.0.0.1:{port}", "--protocol",
                                "modbus_rtu", "--quick", "--json"], capture_output=True,
                               text=True, timeout=10 * LIMIT, check=False)
        assert '"address":"1"' in found.stdout.replace(" ", "") or '"address":1' in \
            found.stdout.replace(" ", ""), found.stdout + found.stderr
        until("polled again", lambda: gate.point() == [100, 192])


def reloaded():
    """A reload that begins the line anew disconnects its client; a trial goes on behind a loan."""
    cable, port = Cable(), free_port()
    Slave(cable)
    more = f'lend: {{ at: "127.0.0.1:{port}" }}'
    with Gateway(lambda gate: polled(cable, more, gate.listener)) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        with connect(port) as client:
            client.sendall(b"x")
            until("lent", lambda: lent(gate))
            gate.reload("poll: 50ms", "poll: 60ms")
            assert is_closed(client)
        until("polled again", lambda: gate.point() == [100, 192])
        equal("the port", gate.line()["port_state"], "open")
        back = [json.loads(text) for text in gate.ask("writes", "--json").stdout.splitlines()]
        assert any("a reload has changed" in record["reason"] for record in back), back

        gate.reload("poll: 60ms", "poll: 50ms", "--confirm", "60s")
        until("polled on trial", lambda: gate.point() == [100, 192])
        equal("release", gate.ask("release", "bay", "--for", "1s").returncode, 0)
        until("polled again", lambda: gate.point() == [100, 192])
        with connect(port) as client:
            client.sendall(b"x")
            until("lent on trial", lambda: lent(gate))
            refused = gate.ask("release", "bay")
            equal("release of a port that is in use", refused.returncode, 2)
            assert "client 127.0.0.1:" in refused.stderr, refused.stderr
        until("polled again", lambda: gate.point() == [100, 192])
        state = json.loads(gate.ask("status", "--json").stdout)["configuration"]
        assert state["confirm_until"], state["not_the_file"]


def killed():
    cable, port = Cable(), free_port()
    Slave(cable)
    more = f'lend: {{ at: "127.0.0.1:{port}", mode: rfc2217 }}'
    with Gateway(lambda gate: polled(cable, more, gate.listener)) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        client = serial.serial_for_url(f"rfc2217://127.0.0.1:{port}", baudrate=1200)
        until("lent", lambda: lent(gate))
        os.kill(gate.process.pid, signal.SIGKILL)
        gate.process.wait()
        equal("as the client left it", cable.baud(), 1200)
        gate.start()
        until("polled again", lambda: gate.point() == [100, 192])
        equal("own settings", cable.baud(), 19200)
        client.close()


def many():
    cable, port = Cable(), free_port()
    slave = Slave(cable)
    more = f'lend: {{ at: "127.0.0.1:{port}" }}'
    ask = bytes([1, 3, 0, 1, 0, 1])
    states = [b"", b"\x01", ask + crc(ask), bytes(5000)]
    with Gateway(lambda gate: polled(cable, more, gate.listener)) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        before = gate.sockets()
        for i in range(200):
            client = connect(port)
            try:
                client.sendall(states[i % 4])
                if i % 3 == 0:
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER,
                                      struct.pack("ii", 1, 0))
                if i % 5 == 0:
                    client.settimeout(0.05)
                    client.recv(1)
            except (OSError, TimeoutError):
                pass  # it was refused, or nothing came
            client.close()
        until("no socket is left", lambda: gate.sockets() <= before)
        until("polled again", lambda: gate.point() == [100, 192])
        asked = slave.asked
        until("polls go on", lambda: slave.asked > asked + 5)


def mbpoll():
    cable, port = Cable(), free_port()
    Slave(cable)
    link = os.path.join(tempfile.mkdtemp(), "tty")
    with Gateway(lambda _: served(cable, port)):
        with subprocess.Popen(["socat", f"pty,link={link},rawer", f"tcp:127.0.0.1:{port}"]) as socat:
            until("socat's pty", lambda: os.path.exists(link))
            done = subprocess.run(["mbpoll", "-m", "rtu", "-a", "1", "-b", "9600", "-P", "none",
                                   "-0", "-r", "5", "-c", "3", "-t", "4", "-1", link],
                                  capture_output=True, text=True, timeout=LIMIT, check=False)
            socat.terminate()
        assert "105" in done.stdout and "107" in done.stdout, done.stdout + done.stderr


def framing():
    cable = Cable()
    Slave(cable)
    ports = {name: free_port() for name in ("tcp", "rtu", "ascii")}
    listen = ", ".join(f'{{ at: "127.0.0.1:{port}", framing: {name} }}'
                       for name, port in ports.items())

    def config(gate):
        return polled(cable, "", gate.listener).replace(
            f'listen: "127.0.0.1:{gate.listener}"',
            f'listen: [ "127.0.0.1:{gate.listener}", {listen} ]')

    ask = bytes([1, 3, 0, 0, 0, 1])
    lrc = bytes([-sum(ask) & 0xFF])
    frames = {"tcp": bytes([0, 1, 0, 0, 0, 6]) + ask, "rtu": ask + crc(ask),
              "ascii": b":" + (ask + lrc).hex().upper().encode() + b"\r\n"}
    answer = bytes([1, 3, 2, 0, 100])
    answers = {"tcp": bytes([0, 1, 0, 0, 0, 5]) + answer, "rtu": answer + crc(answer),
               "ascii": b":" + (answer + bytes([-sum(answer) & 0xFF])).hex().upper().encode()
               + b"\r\n"}
    with Gateway(config) as gate:
        until("polled", lambda: gate.point() == [100, 192])
        for name, port in ports.items():
            with connect(port) as client:
                for byte in frames[name]:
                    client.sendall(bytes([byte]))
                equal(name, receive(client, len(answers[name])), answers[name])
            for other, frame in frames.items():
                if other == name:
                    continue
                with connect(port) as client:
                    client.sendall(frame)
                    assert is_closed(client), f"{other} at a listener for {name}"
                text = gate.ask("status").stdout
                said = " ".join(text.split())
                assert f"set framing: {other}" in said, f"{other} at {name}: {said}"


def ser2net():
    """ser2net as the other end: the gateway polls through it, and its client is pyserial."""
    cable, far, port = Cable(), free_port(), free_port()
    Slave(cable)
    folder = tempfile.mkdtemp()
    with open(os.path.join(folder, "ser2net.yaml"), "w", encoding="utf-8") as file:
        file.write(f"connection: &one\n  accepter: tcp,127.0.0.1,{far}\n"
                   f"  connector: serialdev,{cable.port},19200n81,local\n")
    with subprocess.Popen(["ser2net", "-n", "-c", folder + "/ser2net.yaml", "-u"]) as other:
        cable.port = f"tcp://127.0.0.1:{far}"
        more = f'lend: {{ at: "127.0.0.1:{port}", mode: rfc2217 }}'
        with Gateway(lambda gate: polled(cable, more, gate.listener)) as gate:
            until("polled through ser2net", lambda: gate.point() == [100, 192])
            with connect(port) as client:
                ask = bytes([1, 3, 0, 9, 0, 1])
                client.sendall(ask + crc(ask))
                until("lent", lambda: lent(gate))
            until("polled again", lambda: gate.point() == [100, 192])
        other.terminate()


PARTS = {part.__name__: part for part in (raw, wait, rfc2217, flow, lend, by_hand, reloaded, killed, many,
                                          mbpoll, framing, ser2net)}

if __name__ == "__main__":
    names = sys.argv[2:] or [name for name in PARTS if name != "ser2net"]
    with tempfile.TemporaryDirectory(prefix="serial_server.", ignore_cleanup_errors=True) as tempfile.tempdir:
        for name in names:
            PARTS[name]()
            print(name + ": ok", flush=True)
