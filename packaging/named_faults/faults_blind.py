# SPDX-License-Identifier: Apache-2.0
"""Faults that were not named when strangers invented them from the documents alone."""

import manners as m
import ports as p
from fault import Fault, family

OTHER = "gap|second master|power|bit rate"
BLOCKS = tuple(f"{{ name: p{i}, read: holding {i}, type: uint16 }}" for i in range(10)) + tuple(
    f"{{ name: q{i}, read: holding {500 + i}, type: uint16 }}" for i in range(10))


def first_lost(count):
    return m.sends(lambda x: x.reply.lstrip(b"\n")[count:])


def two_lost(x):
    middle = len(x.reply) // 2
    return x.reply[:middle - 1] + x.reply[middle + 1:]


def in_second_block(change):
    """The values of one block have a special byte now and then."""

    def changed(x):
        if int.from_bytes(x.slave.request_pdu(x.request)[1:3], "big") < 500 or x.number % 4 < 2:
            return x.reply
        x.number = 0
        return change(x)

    return changed


def both_pull(x):
    """Two devices speak at once, and each bit is 0 where one of them says so."""
    other = m.other_value(x)
    return bytes(a & b for a, b in zip(x.reply, other))


def closes_behind(seconds):
    return lambda x: m.well(x) + [(m.THINK + seconds, p.CLOSE)]


def closes_inside(x):
    return [(m.THINK, m.half(x)), (m.THINK + 0.001, p.CLOSE)]


def flipped_digit(x):
    return x.reply.replace(b"+01.5", b"+81.5") if x.number % 6 == 3 else x.reply


def beyond(last):
    """The device has registers up to `last`."""

    def manner(x):
        pdu = x.slave.request_pdu(x.request)
        first, count = int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
        return m.sends(m.exception(2))(x) if first + count > last + 1 else m.well(x)

    return manner


def restarts(x):
    """Every 15 s it is silent for 5 s, and says then what it is."""
    phase = x.wire.elapsed() % 15
    if phase < 5:
        return []
    return [(m.THINK, b"U-Boot 2013.04 (board rev 2)\r\n")] if phase < 5.6 else m.well(x)


def register(value):
    """The last register of each reply."""
    return m.sends(m.pdu(lambda q: q[:-2] + value.to_bytes(2, "big")))


ROW = tuple(f"{{ name: p{i}, read: holding {i}, type: uint16 }}" for i in range(6))
FLOATS = ("{ name: u, read: holding 0, type: float32 }", "{ name: i, read: holding 2, type: float32 }", "{ name: n, read: holding 40, type: uint16 }")

CLASSES = family(
    "classes of issue 57",
    Fault("one late among twenty missing", "rtu spa dcon", lambda x: m.late(0.75)(x) if x.number % 21 == 20 else [], "not a byte|no answer", "power|wir", "timing", "alone beside"),
    Fault("half of the request in front of the reply", "rtu spa ascii", m.sends(lambda x: x.request[:len(x.request) // 2] + x.reply), "request comes back|echo", "echo", OTHER + "|noise", "alone beside"),
    Fault("all but the last bytes of the request in front", "rtu spa dcon", m.sends(lambda x: x.request[:-2] + x.reply), "request comes back|echo", "echo", OTHER + "|noise", "alone beside"),
    Fault("1 to 4 first bytes lost", "rtu ascii spa dcon", m.sends(lambda x: x.reply.lstrip(b"\n")[1 + x.number % 4:]), "first bytes?.*(too late|missing)", "automatic direction control|delay", OTHER, "alone beside"),
    Fault("0 to 4 first bytes lost", "rtu ascii spa", m.sends(lambda x: x.reply.lstrip(b"\n")[x.number % 5:]), "first bytes?.*(too late|missing)", "automatic direction control|delay", OTHER, "alone beside"),
    Fault("restarts with a text", "rtu spa", restarts, "restarts.*U-Boot|(stops answering|did not answer).*restarts", "power|firmware", "bit rate|take it off|console", "alone beside"),
    Fault("only the last register is refused", "rtu tcp ascii", beyond(4), "off by one", "lower", OTHER + "|note", points=ROW),
    Fault("silent, with a checksum", "dcon dcon0 set", m.silent, "not a byte", "checksum", "gap", "alone beside"),
    Fault("garbage, with a checksum", "dcon dcon0 set", m.sends(m.garbage), "setting differs|cannot be read|no good frame", "checksum", "gap", "alone beside"),
    Fault("FF9C beside small values", "rtu tcp", register(0xFF9C), "65436", "int16", OTHER, points=ROW),
    Fault("7FFF", "rtu tcp", register(0x7FFF), "32767", "sentinels|measured", OTHER, points=ROW),
    Fault("damage and losses in turn", "rtu spa dcon", lambda x: [] if x.wire.elapsed() % 20 < 4 else m.now_and_then(m.sends(m.bad_check), 4)(x), "damaged|no answer|stops answering|did not answer", "wire|noise|power", OTHER.replace("|power", "")),
    Fault("an optional register", "rtu tcp ascii", m.of_request(b"\x00\x28", m.sends(m.exception(2))), "", "", well=True),
    Fault("a NaN beside others", "rtu tcp", m.sends(m.pdu(lambda q: q[:2] + b"\x43\x66\x80\0\x7f\xc0\0\0" if len(q) == 10 else q)), "", "", well=True, points=FLOATS),
    Fault("values that change", "dcon0", m.sends(lambda x: x.reply.replace(b"+01.5", b"+%02d.5" % (x.number * 7 % 60)) if x.request[:1] == b"#" else x.reply), "far from the one before", "recheck", "damaged|says itself"),
)

BLIND = family(
    "found blind",
    Fault("two bytes lost inside", "rtu", m.sends(two_lost), "missing|too few|short", "raw|converter|wire|firmware", OTHER + "|noise", "alone beside"),
    Fault("two bytes lost inside now and then", "rtu set", m.now_and_then(m.sends(two_lost)), "missing|too few|short", "raw|converter|wire", OTHER, "alone beside"),
    Fault("first 5 lost", "spa ascii dcon", first_lost(5), "first bytes", "converter|direction|delay", OTHER, "alone beside"),
    Fault("first 8 lost", "spa ascii", first_lost(8), "first bytes", "converter|direction|delay", OTHER, "alone beside"),
    Fault("a DCON master", "rtu spa", m.well, "DCON", "line of its own|separate|take", "gap|power|bit rate", "alone beside", events=((0.77, lambda s: b"#01\r"),)),
    Fault("11 swallowed in one block", "rtu", m.sends(in_second_block(m.valued(0x11, lambda r: r.replace(b"\x11", b"")))), "11|missing", "XON|raw", OTHER, points=BLOCKS),
    Fault("13 swallowed in one block", "rtu", m.sends(in_second_block(m.valued(0x13, lambda r: r.replace(b"\x13", b"")))), "13|missing", "XON|raw", OTHER, points=BLOCKS),
    Fault("two pull at once", "rtu ascii dcon", m.sends(both_pull), "two devices|check value|damaged", "address|noise|computes|wire", "gap|second master|power|Modbus TCP", "alone beside"),
    Fault("7 bits after one good reply", "rtu", lambda x: m.well(x) if x.number == 0 else m.sends(m.seven_bits)(x), "data bits|eighth bit", "serial server", "gap|power|second master", line="TCP"),
    Fault("closes after 0.5 s", "tcp rtu", closes_behind(0.5), "", "", line="TCP", well=True),
    Fault("closes at one request", "tcp", lambda x: p.CLOSE if b"\0\x28" in x.request else m.well(x), "ends the connection at the request for torque", "take|points|profile", OTHER, "alone beside"),
    Fault("closes inside replies", "tcp rtu", closes_inside, "break off|inside|half-way|clos(ed?|es|ing)", "server|firmware|buffer", "gap|second master", line="TCP"),
    Fault("a quarter lost, slow to be given up", "dcon dcon0 rtu", lambda x: m.well(x) if x.random.random() > 0.25 else [], "now and then a request gets no answer", "wire|plug|noise", "gap|stops answering|did not answer|restart|bit rate", "alone beside", device="timing: { reply: 1s }"),
    Fault("other bit rate since 12 s", "spa rtu dcon", m.dies_at(12, m.sends(m.wrong_rate(2.0))), "bit rate", "set the same bit rate|changed", "gap|power", "alone beside"),
    Fault("eighth bit since 12 s", "spa ascii", m.dies_at(12, m.sends(m.eighth_bit)), "eighth bit", "7E1|7O1|serial server", "gap|power", line="TCP"),
    Fault("digits flip", "dcon0", m.sends(flipped_digit), "changed when they were read again", "checksum", OTHER),
    Fault("one FF behind", "rtu ascii dcon spa", m.sends(m.behind(b"\xff")), "", "", well=True),
    Fault("the server ends each connection after 3.3 s", "rtu set", m.well, "ended the connection", "limit of connections at the server", "gap|bit rate", "alone beside", line="TCP", drops=(3.3, 0)),
    Fault("two strange bytes before some replies", "rtu spa", m.sends(lambda x: (bytes([0x35 + x.number % 7, 0x9D]) if x.number % 5 < 2 else b"") + x.reply), "stray bytes come before", "bias|terminat|ground", "gap|power"),
    Fault("addresses that do not come", "dcon", m.well, "no address|another module", "data_address: false", OTHER, device="data_address: true"),
    Fault("it refuses what it gave", "rtu", m.dies_at(12, m.sends(m.exception(2))), "answered before", "another device|restart", OTHER),
    Fault("a quiet that fills the line", "rtu spa", m.well, "more time than the line has", "quiet", "gap|power", "both", device="timing: { quiet: 300ms }\n        poll: 200ms"),
)
