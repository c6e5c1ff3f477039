# SPDX-License-Identifier: Apache-2.0
"""Small slaves of every protocol, written from the public descriptions and not from the gateway's own code.

A slave takes what was heard and gives (address, request, reply) for each whole request; reply None: it is none of its own.
"""

import struct


def crc16(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1
    return struct.pack("<H", value)


def crc_ok(data):
    return len(data) > 3 and crc16(data[:-2]) == data[-2:]


def xor(text):
    value = 0
    for byte in text:
        value ^= byte
    return b"%02X" % value


def total(text):
    return b"%02X" % (sum(text) & 0xFF)


def lrc(data):
    return (-sum(data)) & 0xFF


class Spa:
    """Slave numbers in decimal, `>1RI1/3:05` CR."""

    name, serial, addresses = "spabus", "9600 7E1", (1, 2)
    points = ["{ name: current_l1, read: I1, type: float32 }", "{ name: current_l2, read: I2, type: float32 }",
              "{ name: current_l3, read: I3, type: float32 }", "{ name: trip, read: O2, type: bool }",
              "{ name: setting, read: V150, type: uint16, group: slow }"]
    check = staticmethod(xor)

    @staticmethod
    def wrap(address, body):
        text = b"<%d%s:" % (address, body)
        return b"\n" + text + xor(text) + b"\r\n"

    def requests(self, heard):
        while b"\r" in heard:
            line, _, heard = heard.partition(b"\r")
            line = line[line.rfind(b">"):] if b">" in line else b""
            if line:
                yield self.one(line)
        return heard

    def one(self, line):
        head = line[1:].split(b":")[0]
        digits = head[:next((i for i, c in enumerate(head) if not 48 <= c < 58), len(head))]
        address, what = int(digits or b"0"), head[len(digits):]
        if not what.startswith(b"R"):
            return address, line + b"\r", self.wrap(address, b"A")
        kind = what[1:2]
        if kind in b"F":
            body = b"SPCJ 4D29"
        elif kind in b"CLBT":
            body = b"0" if kind == b"C" else b""
        else:
            first, _, last = what[2:].partition(b"/")
            count = int(last or first) - int(first) + 1
            binary = kind == b"O"
            body = b"/".join(b"0" if binary else b"%d" % (int(first) + i) if kind == b"V" else b"0.%02d" % (50 + i)
                             for i in range(count))
        return address, line + b"\r", self.wrap(address, b"D:" + body)

    @staticmethod
    def body_of(reply):
        text = reply.strip()[1:-3]
        return text[next(i for i, c in enumerate(text) if not 48 <= c < 58):]

    def as_address(self, reply, address, other):
        return self.wrap(other, self.body_of(reply))

    def bad_check(self, reply):
        at = reply.rstrip().__len__() - 2
        return reply[:at] + (b"00" if reply[at:at + 2] != b"00" else b"11") + reply[at + 2:]

    def foreign(self):
        text = b">9RI1:"
        return text + xor(text) + b"\r"


class Dcon:
    """`#01` CR; addresses in hex."""

    name, serial, addresses, with_sum, extra = "dcon", "9600 8N1", (1, 2), True, "channels: 4, checksum: true"
    points = ["{ name: level, read: \"#[0]\", type: float32 }", "{ name: flow, read: \"#[1]\", type: float32 }",
              "{ name: heat, read: \"#[3]\", type: float32 }"]
    count = 4

    def wrap(self, body):
        return body + (total(body) if self.with_sum else b"") + b"\r"

    def requests(self, heard):
        while b"\r" in heard:
            line, _, heard = heard.partition(b"\r")
            at = max(line.rfind(c) for c in (b"#", b"$", b"@", b"~", b"%"))
            if at >= 0 and len(line) >= at + 3:
                yield self.one(line[at:])
        return heard

    def one(self, line):
        text = line[:-2] if self.with_sum else line
        try:
            address = int(text[1:3], 16)
        except ValueError:
            address = 0
        if self.with_sum and total(text) != line[-2:]:
            return address, line + b"\r", None
        lead = b"!%02X" % address
        if text.startswith(b"#"):
            channels = range(self.count) if len(text) == 3 else [0]
            return address, line + b"\r", self.wrap(b">" + b"".join(b"+%06.3f" % (1.5 + n) for n in channels))
        if text[3:] == b"M":
            return address, line + b"\r", self.wrap(lead + b"7017")
        if text[3:] == b"2":
            return address, line + b"\r", self.wrap(lead + (b"080640" if self.with_sum else b"080600"))
        return address, line + b"\r", self.wrap(b"?%02X" % address)

    def bad_check(self, reply):
        return reply[:-3] + (b"00" if reply[-3:-1] != b"00" else b"11") + b"\r"

    def foreign(self):
        return self.wrap(b"$09M")


class DconPlain(Dcon):
    """Without checksums."""

    with_sum, extra = False, "channels: 4"


class Set4tm:
    name, serial, addresses = "set4tm", "9600 8O1", (20, 21)
    points = ["{ name: voltage, read: \"08 1B 00 11 float_le@0\", type: float32 }",
              "{ name: current, read: \"08 1B 00 21 float_le@0\", type: float32 }",
              "{ name: counts, read: \"05 00 00 counts@0\", type: uint32 }"]
    check_bytes = 2

    @staticmethod
    def wrap(address, body):
        frame = bytes([address]) + body
        return frame + crc16(frame)

    def requests(self, heard):
        for at in range(len(heard)):
            if crc_ok(heard[at:]):
                yield self.one(heard[at:])
                return b""
        return heard

    def one(self, frame):
        address, pdu = frame[0], frame[1:-2]
        values = {
            b"\x08\x00": struct.pack(">I", 9020000 + address) + b"\x06\x09\x02", b"\x08\x12": b"\x74\xA0\x80",
            b"\x08\x02": b"\0\1\0\1" + bytes(6), b"\x08\x05": bytes([0, address]),
            b"\x08\x1B\x00\x11": struct.pack("<f", 230.5), b"\x08\x1B\x00\x21": struct.pack("<f", 4.25),
            b"\x05\x00\x00": struct.pack(">4I", 10001, 0, 5001, 101),
        }
        status = b"\x00" if pdu[:1] in (b"\x00", b"\x01", b"\x02") else b"\x01"
        return address, frame, self.wrap(address, values.get(pdu, status))

    @staticmethod
    def body_of(reply):
        return reply[1:-2]

    def as_address(self, reply, address, other):
        return self.wrap(other, reply[1:-2])

    def bad_check(self, reply):
        return reply[:-1] + bytes([reply[-1] ^ 0x5A])

    def foreign(self):
        return self.wrap(9, b"\x08\x1B\x00\x11")


class Set4tmByNumber(Set4tm):
    """Addressed by its serial number."""

    addresses = ("sn:9020001",)

    @staticmethod
    def wrap(address, body):
        number = b"\xFC" + struct.pack(">I", int(address[3:])) if isinstance(address, str) else address
        frame = number + body
        return frame + crc16(frame)

    def one(self, frame):
        if frame[0] != 0xFC:
            return frame[0], frame, None
        _, _, reply = Set4tm().one(b"\x14" + frame[5:])
        return "sn:%d" % struct.unpack(">I", frame[1:5])[0], frame, self.wrap(frame[:5], reply[1:-2])

    @staticmethod
    def body_of(reply):
        return reply[5:-2]


def modbus_pdu(pdu):
    function = pdu[0]
    if function > 4 or len(pdu) < 5:
        return bytes([function | 0x80, 1])
    first, count = struct.unpack(">HH", pdu[1:5])
    if function < 3:
        data = bytes((count + 7) // 8)
    else:
        data = b"".join(struct.pack(">H", 100 + first + n) for n in range(count))
    return bytes([function, len(data)]) + data


class Rtu:
    name, serial, addresses = "modbus_rtu", "19200 8E1", (1, 2)
    points = ["{ name: speed, read: holding 10, type: uint16 }", "{ name: torque, read: holding 40, type: uint32 }",
              "{ name: heat, read: input 3, type: uint16 }", "{ name: on, read: coil 5, type: bool }"]
    check_bytes = 2

    def wrap(self, address, pdu):
        frame = bytes([address]) + pdu
        return frame + crc16(frame)

    def requests(self, heard):
        for at in range(len(heard)):
            if crc_ok(heard[at:at + 8]):
                frame = heard[at:at + 8]
                yield frame[0], frame, self.wrap(frame[0], modbus_pdu(frame[1:-2]))
                return b""
        return heard

    def pdu(self, reply):
        return reply[1:-2]

    def as_address(self, reply, address, other):
        return self.wrap(other, reply[1:-2])

    def bad_check(self, reply):
        return reply[:-1] + bytes([reply[-1] ^ 0x5A])

    def with_pdu(self, request, pdu):
        return self.wrap(request[0], pdu)

    def request_pdu(self, request):
        return request[1:-2]

    def foreign(self):
        return self.wrap(9, b"\x03\x00\x10\x00\x02")


class Ascii(Rtu):
    name, serial = "modbus_ascii", "9600 7E1"

    def wrap(self, address, pdu):
        frame = bytes([address]) + pdu
        return b":" + (frame + bytes([lrc(frame)])).hex().upper().encode() + b"\r\n"

    def requests(self, heard):
        while b"\r\n" in heard:
            line, _, heard = heard.partition(b"\r\n")
            try:
                frame = bytes.fromhex(line[line.rfind(b":") + 1:].decode())
            except ValueError:
                continue
            if len(frame) > 3 and not sum(frame) & 0xFF:
                yield frame[0], line + b"\r\n", self.wrap(frame[0], modbus_pdu(frame[1:-1]))
        return heard

    def pdu(self, reply):
        return bytes.fromhex(reply[1:-2].decode())[1:-1]

    def as_address(self, reply, address, other):
        return self.wrap(other, self.pdu(reply))

    def bad_check(self, reply):
        return reply[:-4] + (b"00" if reply[-4:-2] != b"00" else b"11") + b"\r\n"

    def with_pdu(self, request, pdu):
        return self.wrap(bytes.fromhex(request[1:3].decode())[0], pdu)

    def request_pdu(self, request):
        return self.pdu(request)


class Tcp(Rtu):
    name, serial = "modbus_tcp", None

    def requests(self, heard):
        while len(heard) >= 8:
            size = 6 + struct.unpack(">H", heard[4:6])[0]
            frame, heard = heard[:size], heard[size:]
            yield frame[6], frame, self.with_pdu(frame, modbus_pdu(frame[7:]))
        return heard

    def with_pdu(self, request, pdu):
        return request[:4] + struct.pack(">H", len(pdu) + 1) + request[6:7] + pdu

    def request_pdu(self, request):
        return request[7:]

    def pdu(self, reply):
        return reply[7:]

    def as_address(self, reply, address, other):
        return reply[:6] + bytes([other]) + reply[7:]


class Reader:
    """Speaks by itself."""

    name, serial, addresses = "reader", "9600 8N1", (1,)
    points = ["{ name: tag, read: tag, type: string(16) }", "{ name: counter, read: counter, type: uint32 }"]

    def requests(self, heard):
        return b""
        yield  # a generator


class Nmea(Reader):
    """Sentences of a weather station."""

    name, serial = "telegram", "4800 8N1"


class Balance:
    """MT-SICS: `SI` CR LF."""

    name, serial, addresses = "telegram", "9600 8N1", (1,)

    def requests(self, heard):
        while b"\n" in heard:
            line, _, heard = heard.partition(b"\n")
            replies = {b"SI": b"S S     100.00 g\r\n", b"I4": b'I4 A "0123456789"\r\n', b"TA": b"TA A       0.00 g\r\n"}
            yield 1, line + b"\n", replies.get(line.strip(), b"ES\r\n")
        return heard


KINDS = {"spa": Spa, "dcon": Dcon, "dcon0": DconPlain, "set": Set4tm, "setx": Set4tmByNumber, "rtu": Rtu, "ascii": Ascii, "tcp": Tcp, "reader": Reader, "nmea": Nmea, "balance": Balance}
