# SPDX-License-Identifier: Apache-2.0
"""A gateway and the wires of it: ptys and sockets, at whose other ends slaves answer as their faults want it."""

import heapq
import json
import os
import pty
import select
import socket
import subprocess
import time
import tty

import ports
from manners import Exchange, well


class Wire:
    """One line: what its slaves hear, and what they say when."""

    def __init__(self, rig, case):
        self.rig, self.case, self.heard, self.last, self.numbers = rig, case, b"", 0.0, {}
        self.spoken, self.idle = 0.0, 9.0  # when something was on the bus last; the silence before a request
        self.fd, self.connection, self.server = None, None, None
        case.slave.elapsed = self.elapsed
        if case.fault.port:
            self.port = case.fault.port(rig.folder)
            return
        if case.slave.serial is None or case.fault.line == "TCP":
            self.server = socket.create_server(("127.0.0.1", 0))
            self.server.setblocking(False)
            rig.poll.register(self.server, select.POLLIN)
            rig.files[self.server.fileno()] = self.accept
            self.port = f"tcp://127.0.0.1:{self.server.getsockname()[1]}"
            if case.fault.drops:
                rig.at(case.fault.drops[0], self.drop)
        else:
            self.fd, keep = pty.openpty()
            tty.setraw(keep)
            rig.kept.append(keep)
            os.set_blocking(self.fd, False)
            self.port = os.ttyname(keep)
            rig.watch(self.fd, self.read)
        for every, data in case.fault.events:
            rig.at(every, lambda every=every, data=data: self.speak(every, data))

    def elapsed(self):
        return time.monotonic() - self.rig.start

    def speak(self, every, data):
        self.write(data(self.case.slave))
        self.rig.at(every, lambda: self.speak(every, data))

    def drop(self):
        """The connection ends, and for a while none is taken."""
        every, away = self.case.fault.drops
        if self.connection:
            self.close()
        if away:
            address = self.server.getsockname()
            self.rig.forget(self.server.fileno())
            self.server.close()
            self.rig.at(away, lambda: self.listen(address))
        self.rig.at(every, self.drop)

    def listen(self, address):
        self.server = socket.create_server(address)
        self.server.setblocking(False)
        self.rig.watch(self.server.fileno(), self.accept)

    def accept(self):
        if self.connection:
            self.close()
        self.connection, _ = self.server.accept()
        if self.case.fault.refuses:
            self.connection.close()
            self.connection = None
            return
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connection.setblocking(False)
        self.fd = self.connection.fileno()
        self.rig.watch(self.fd, self.read)
        if self.case.fault.greeting:
            self.write(self.case.fault.greeting)

    def close(self):
        if self.connection is None:
            return
        self.rig.forget(self.fd)
        self.connection.close()
        self.connection, self.fd = None, None

    def write(self, data):
        if self.fd is None or not data:
            return
        self.spoken = time.monotonic()
        try:
            os.write(self.fd, data)
        except OSError:
            pass

    def read(self):
        try:
            data = os.read(self.fd, 4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            if self.connection:
                self.close()
            return
        now = time.monotonic()
        if now - self.last > 0.1:
            self.heard = b""
        if not self.heard:
            self.idle = now - self.spoken
        self.spoken = now
        self.last = now
        slave = self.case.slave
        requests = slave.requests(self.heard + data)
        while True:
            try:
                address, request, reply = next(requests)
            except StopIteration as end:
                self.heard = end.value or b""
                return
            self.answer(address, request, reply)
            if self.fd is None:
                return

    def answer(self, address, request, reply):
        name = self.case.devices().get(address)
        if name is None or reply is None:
            return
        number = self.numbers.get(address, 0)
        self.numbers[address] = number + 1
        manner = self.case.fault.how if name.startswith("ill") else well
        exchange = Exchange(self.case.slave, self, address, request, reply, number)
        said = ports.CLOSE if manner is ports.CLOSE else manner(exchange)
        if said is ports.CLOSE:
            self.close()
            return
        for delay, data in said:
            self.rig.at(delay, lambda data=data, on=self.connection: self.say(data, on))

    def say(self, data, connection):
        """To the connection over which it was asked: a later one does not get it."""
        if connection is not self.connection:
            return
        if data is ports.CLOSE:
            self.close()
        else:
            self.write(data)


class Rig:
    """A gateway and all wires of it."""

    def __init__(self, cases, program, folder):
        self.folder, self.poll, self.files, self.times, self.kept = folder, select.poll(), {}, [], []
        self.start = self.woken = time.monotonic()
        self.lag = 0.0  # by which the slaves were later than they should have been
        self.wires = [Wire(self, case) for case in cases]
        self.config = os.path.join(folder, "gateway.yaml")
        self.socket = os.path.join(folder, "gateway.sock")
        with open(self.config, "w") as out:
            out.write(f"gateway: {{ name: named-faults, socket: {self.socket}, state: {folder}/state }}\nlines:\n")
            out.writelines(wire.case.config(wire.port) for wire in self.wires)
        self.log = open(os.path.join(folder, "log"), "w")
        self.program = program
        self.process = subprocess.Popen([program, "run", "-c", self.config], stdout=self.log, stderr=self.log)

    def watch(self, fd, call):
        self.files[fd] = call
        self.poll.register(fd, select.POLLIN)

    def forget(self, fd):
        self.files.pop(fd, None)
        self.poll.unregister(fd)

    def at(self, delay, call):
        heapq.heappush(self.times, (time.monotonic() + delay, len(self.times), id(call), call))

    def run_until(self, end):
        while (now := time.monotonic()) < end:
            self.lag = max(self.lag, now - self.woken)
            while self.times and self.times[0][0] <= now:
                heapq.heappop(self.times)[-1]()
            until = min(self.times[0][0] if self.times else end, end)
            self.woken = max(until, time.monotonic())
            for fd, _ in self.poll.poll(max(0.0, until - time.monotonic()) * 1000):
                if fd in self.files:
                    self.files[fd]()

    def status(self):
        """While the wires go on."""
        ask = subprocess.Popen([self.program, "status", "--json", "--socket", self.socket], stdout=subprocess.PIPE)
        os.set_blocking(ask.stdout.fileno(), False)
        text, end = b"", time.monotonic() + 20
        while time.monotonic() < end:
            ended = ask.poll() is not None
            text += ask.stdout.read() or b""
            if ended:
                return json.loads(text) if text else None
            self.run_until(time.monotonic() + 0.02)
        ask.kill()
        return None

    def stop(self):
        self.process.terminate()
        end = time.monotonic() + 10
        while self.process.poll() is None and time.monotonic() < end:
            self.run_until(time.monotonic() + 0.05)
        if self.process.poll() is None:
            self.process.kill()
        for wire in self.wires:
            for one in (wire.connection, wire.server):
                if one:
                    one.close()
            if wire.fd is not None and not wire.connection and not wire.server:
                os.close(wire.fd)
        for fd in self.kept:
            os.close(fd)
        self.log.close()
