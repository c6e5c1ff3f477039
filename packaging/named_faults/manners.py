# SPDX-License-Identifier: Apache-2.0
"""How a slave or its line misbehaves: a function of one exchange that gives what is sent, as (delay in seconds, bytes)."""

import random

THINK = 0.02  # seconds from the request to the reply


class Exchange:
    def __init__(self, slave, wire, address, request, reply, number):
        self.slave, self.wire, self.address = slave, wire, address
        self.idle = wire.idle  # seconds of silence before the request
        self.request, self.reply, self.number = request, reply, number  # number: from 0, of this device
        self.random = random.Random(number * 7919 + (address if isinstance(address, int) else 1))


def well(x):
    return [(THINK, x.reply)]


def silent(x):
    return []


def sends(change, delay=THINK):
    """The reply, changed."""

    def manner(x):
        reply = change(x)
        return [(delay, reply)] if reply else []

    return manner


def now_and_then(manner, every=3, rest=well):
    return lambda x: manner(x) if x.number % every == every - 1 else rest(x)


def by_time(manner, period, lasts):
    """For `lasts` of each `period` seconds."""
    return lambda x: manner(x) if (x.wire.elapsed() + period - lasts - 1) % period < lasts else well(x)


def of_request(needle, manner):
    """Only where the request has these bytes in it, or their hex digits."""
    digits = needle.hex().upper().encode()
    return lambda x: manner(x) if needle in x.request or x.slave.name == "modbus_ascii" and digits in x.request else well(x)


def late(seconds):
    return lambda x: [(seconds, x.reply)]


def pieces(size, pause):
    return lambda x: [(THINK + i // size * pause, x.reply[i:i + size]) for i in range(0, len(x.reply), size)]


def paused(pause):
    """Once, in the middle."""
    return lambda x: [(THINK, x.reply[:len(x.reply) // 2]), (THINK + pause, x.reply[len(x.reply) // 2:])]


def half(x):
    return x.reply[:len(x.reply) // 2]


def head_lost(x):
    return x.reply.lstrip(b"\n")[1:]


def end_lost(x):
    return x.reply.rstrip(b"\n")[:-1] if x.reply.endswith(b"\n") else x.reply[:-1]


def bad_check(x):
    return x.slave.bad_check(x.reply)


def eaten(byte, every=2):
    """A value has this byte now and then, and something in between eats it."""

    def change(x):
        if x.number % every:
            return x.reply
        if x.slave.name.startswith("modbus"):
            q = x.slave.pdu(x.reply)
            return x.slave.with_pdu(x.request, q[:-1] + bytes([byte])).replace(bytes([byte]), b"")
        return x.slave.wrap(x.address, x.reply[1:-3] + bytes([byte])).replace(bytes([byte]), b"")

    return change


def one_bit(x):
    at = len(x.reply) // 2
    return x.reply[:at] + bytes([x.reply[at] ^ 4]) + x.reply[at + 1:]


def crc_swapped(x):
    return x.reply[:-2] + x.reply[-1:] + x.reply[-2:-1]


def garbage(x):
    return x.random.randbytes(x.random.randint(4, len(x.reply) + 2))


def bits_of(data, width, parity):
    for byte in data:
        yield 0
        ones = 0
        for i in range(width):
            ones += byte >> i & 1
            yield byte >> i & 1
        if parity:
            yield ones & 1 if parity == "E" else ones & 1 ^ 1
        yield 1


def sampled(data, rate, width, parity):
    """As a receiver with 8 data bits hears it whose bit rate is `rate` times the sender's."""
    wire = list(bits_of(data, width, parity)) + [1] * 20
    out, at = [], 0.0
    end = len(wire) - 12
    while at < end:
        if wire[int(at)]:
            at += 1 / (4 * rate)
            continue
        byte = 0
        for bit in range(8):
            byte |= wire[min(int(at + (1.5 + bit) / rate), len(wire) - 1)] << bit
        out.append(byte)
        at += 9.5 / rate
    return bytes(out)


def wrong_rate(rate):
    return lambda x: sampled(x.reply, rate, 8, "")


def eighth_bit(x):
    """7 data bits with even parity on a port with 8."""
    return bytes(c | (bin(c).count("1") & 1) << 7 for c in x.reply)


def before(data):
    return lambda x: data + x.reply


def behind(data):
    return lambda x: x.reply + data


def noise_before(x):
    return x.random.randbytes(6) + x.reply


def noise_behind(x):
    return x.reply + x.random.randbytes(6)


def dle_framed(x):
    return b"\x10\x02" + x.reply + b"\x10\x03"


def twice(x):
    return [(THINK, x.reply), (THINK + 0.03, x.reply)]


def other_address(other):
    return lambda x: x.slave.as_address(x.reply, x.address, other)


def echo(manner=well):
    return lambda x: [(0.002, x.request)] + manner(x)


def only(data):
    return lambda x: data


def exception(code):
    return lambda x: x.slave.with_pdu(x.request, bytes([x.slave.request_pdu(x.request)[0] | 0x80, code]))


def pdu(change):
    """Another PDU in a right frame."""
    return lambda x: x.slave.with_pdu(x.request, change(x.slave.pdu(x.reply)))


def fewer_registers(p):
    return bytes([p[0], p[1] - 2]) + p[2:-2] if len(p) > 4 else p


def more_registers(p):
    return bytes([p[0], p[1] + 2]) + p[2:] + b"\0\7"


def wrong_count_byte(p):
    return bytes([p[0], p[1] + 1]) + p[2:]


def dcon_line(change):
    """Another text in a right frame."""
    return lambda x: x.slave.wrap(change(x.reply[:-3] if x.slave.with_sum else x.reply[:-1]))


def spa_data(word):
    """As many words as values were asked for; its name (RF) it tells."""
    return lambda x: x.reply if b"RF" in x.request else x.slave.wrap(x.address, b"D:" + b"/".join([word] * (x.reply.count(b"/") + 1)))


def spa_nak(code):
    return lambda x: x.slave.wrap(x.address, b"N:%d" % code)


def set_status(status):
    return lambda x: x.slave.wrap(x.address, bytes([status]))


def as_tcp(x):
    body = x.reply[:-2]
    return b"\0\1\0\0" + bytes([0, len(body)]) + body


def lower_case(x):
    return x.reply.lower()


def inverted(x):
    """A and B swapped, at a receiver that takes what it gets."""
    return bytes(b ^ 0xFF for b in x.reply)


def seven_bits(x):
    return bytes(b & 0x7F for b in x.reply)


def reversed_bits(x):
    return bytes(int(f"{b:08b}"[::-1], 2) for b in x.reply)


def inserted(byte, every=4):
    return lambda x: b"".join(x.reply[i:i + every] + bytes([byte]) for i in range(0, len(x.reply), every))


def newline_for_return(x):
    return x.reply.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def return_doubled(x):
    """Each CR becomes CR LF, and each LF CR LF, as a terminal server does."""
    return x.reply.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n").replace(b"\r", b"\r\r\n")


def broken_echo(x):
    """What is sent comes back damaged, and the reply behind it."""
    return [(0.002, x.request[:-1]), (THINK, x.reply)]


def dies_at(seconds, manner=silent):
    return lambda x: manner(x) if x.wire.elapsed() > seconds else well(x)


def growing(step):
    """Later each time."""
    return lambda x: [(THINK + step * x.number, x.reply)]


def at_most(size):
    """A buffer that holds no more."""
    return lambda x: x.reply[:size]


def copy_after(seconds):
    return lambda x: [(THINK, x.reply), (THINK + seconds, x.reply)]


def one_reply_behind(x):
    """Each request is answered by the reply to the one before."""
    before = getattr(x.wire, "before", None)
    x.wire.before = x.reply
    return [(THINK, before)] if before else []


def marked(x):
    """The driver gives FF for each character with wrong parity: about every second."""
    return bytes(0xFF if bin(b).count("1") & 1 else b for b in x.reply)


def flipped(x):
    """A bit rate that is a little off: high bits are wrong now and then."""
    return bytes(b ^ 0x80 if x.random.random() < 0.15 else b for b in x.reply)


def between(least, most):
    return lambda x: [(least + (most - least) * x.random.random(), x.reply)]


def even(data):
    """7 data bits and even parity, as a port with 8 hears them."""
    return bytes(c & 0x7F | (bin(c & 0x7F).count("1") & 1) << 7 for c in data)


def until(seconds, data):
    """Of a line that speaks by itself: no longer than that."""
    return lambda slave: data if slave.elapsed() < seconds else b""


def spa_check(x, more):
    """The check value covers something else as well."""
    at = x.reply.rstrip().__len__() - 2
    return x.reply[:at] + b"%02X" % (int(x.reply[at:at + 2], 16) ^ more) + x.reply[at + 2:]


def lf_counted(x):
    return spa_check(x, 0x0A)


def spa_wildcard(x):
    return x.reply[:-4] + b"XX\r\n"


def valued(byte, change, every=2):
    """A value has this byte now and then, and something in between changes it."""

    def changed(x):
        if x.number % every:
            return x.reply
        if x.slave.name.startswith("modbus"):
            q = x.slave.pdu(x.reply)
            return change(x.slave.with_pdu(x.request, q[:-1] + bytes([byte])))
        body = x.slave.body_of(x.reply)
        return change(x.slave.wrap(x.address, body[:-1] + bytes([byte]) if len(body) > 1 else body))

    return changed


def stuck(x):
    """Whatever is asked, the first reply comes."""
    x.wire.first = getattr(x.wire, "first", x.reply)
    return [(THINK, x.wire.first)]


def stuck_pdu(x):
    x.wire.first = getattr(x.wire, "first", x.slave.pdu(x.reply))
    return [(THINK, x.slave.with_pdu(x.request, x.wire.first))]


def other_value(x):
    """What another device with the same address says."""
    if x.slave.name.startswith("modbus"):
        q = x.slave.pdu(x.reply)
        return x.slave.with_pdu(x.request, q[:-1] + bytes([q[-1] ^ 1]))
    if x.slave.name == "spabus":
        body = x.slave.body_of(x.reply)
        return x.slave.wrap(x.address, body.replace(b"0.5", b"1.7")) if b"D:" in body else x.reply
    if x.slave.name == "set4tm":
        body = x.slave.body_of(x.reply)
        return x.slave.wrap(x.address, body[:-1] + bytes([body[-1] ^ 1])) if len(body) > 1 else x.reply
    text = x.reply[:-3] if x.slave.with_sum else x.reply[:-1]
    return x.slave.wrap(text.replace(b"1", b"2")) if x.reply[:1] == b">" else x.reply


def collide(x):
    """Both speak at once, a few bits apart: one wins here, the other there, and some characters are neither's."""
    other = other_value(x)
    shift = x.random.randint(0, 3)
    if x.number % 3 == 2:
        return [(THINK, x.reply)]
    both = bytes(a & (other[i - shift] if shift <= i < len(other) + shift else 0xFF) for i, a in enumerate(x.reply))
    return [(THINK, both + other[len(other) - shift:])]


def two_in_turn(x):
    return [(THINK, x.reply), (THINK + 0.03, other_value(x))]


def two_alike(x):
    """Most of what they say is the same."""
    differs = x.random.random() < 0.25
    return [(THINK, x.reply), (THINK + 0.03, other_value(x) if differs else x.reply)]


def needs_pause(seconds):
    """A request that comes sooner behind what was on the bus is not heard."""
    return lambda x: well(x) if x.idle >= seconds else []


def mv110(channels):
    return lambda x: x.slave.wrap(b">" + b"".join(b"+%06.3f" % (1.5 + n) for n in range(channels))) if x.request[:1] == b"#" and len(x.request) == 6 else x.reply


def as_ascii(x):
    frame = bytes([x.address]) + x.slave.pdu(x.reply)
    return b":" + (frame + bytes([-sum(frame) & 255])).hex().upper().encode() + b"\r\n"
