# SPDX-License-Identifier: Apache-2.0
"""Faults that a commissioning engineer may meet: a bad cable, a wrong manual, a cheap converter, a mis-set serial server, a PLC on the same bus,
a cloned address, a device that is half dead."""

import manners as m
import ports as p
from fault import Fault, family

OTHER = "gap|second master|power|bit rate"
WEIGHT = ("{ name: weight, read: number, type: float64 }",)
ROW = tuple(f"{{ name: p{i}, read: holding {i}, type: uint16 }}" for i in range(10))
BLOCKS = ROW + tuple(f"{{ name: q{i}, read: holding {500 + i}, type: uint16 }}" for i in range(10))
LONG = ("{ name: speed, read: holding 10, type: uint16 }", "{ name: label, read: holding 100, type: string(60) }")


def after(seconds, manner):
    """Well until then."""
    return lambda x: manner(x) if x.wire.elapsed() > seconds else m.well(x)


def swapped_pairs(x):
    body = x.slave.pdu(x.reply)
    data = bytearray(body)
    for i in range(2, len(data) - 1, 2):
        data[i], data[i + 1] = data[i + 1], data[i]
    return x.slave.with_pdu(x.request, bytes(data))


def high_bytes(x):
    """Each register is 11xx."""
    body = bytearray(x.slave.pdu(x.reply))
    body[2::2] = b"\x11" * len(body[2::2])
    return x.slave.with_pdu(x.request, bytes(body))


def block_of(x):
    """The first register that is asked for."""
    return int.from_bytes(x.slave.request_pdu(x.request)[1:3], "big")


def echoed_byte(x):
    """The converter gives the last byte of the request back in front of the reply."""
    return x.request[-1:] + x.reply


INVENTED = family(
    "a bad cable",
    Fault("one wire loose: half of the time", "rtu spa dcon", m.by_time(m.silent, 8, 4), "stops answering|did not answer|outage", "wire|power", OTHER.replace("|power", "")),
    Fault("no ground: every tenth damaged", "rtu spa", m.now_and_then(m.sends(m.one_bit), 5), "damaged", "ground|noise|terminat", "gap|second master|bit rate"),
    Fault("no termination: tail rings", "rtu set", m.sends(m.behind(b"\xfc\xc0\xf8\xff\xfe")), "stray|same bytes|noise|follow", "terminat|bias", OTHER),
    Fault("no bias: garbage between", "rtu spa dcon", m.well, "noise|stray|nothing was asked|by itself", "bias|terminat", "power|gap", events=((0.7, lambda s: b"\x00\xf0\x00\xfe\x80\x00\xfc"),)),
    Fault("cut while running", "rtu spa", after(12, m.silent), "offline for.*not a byte", "power|wire", "bit rate|second master"),
    Fault("A and B swapped while running", "rtu spa", after(12, m.sends(m.inverted)), "A and B|damaged|inverted|swapped", "A and B|wire|wiring", "gap|second master|power"),
    Fault("crosstalk: bytes of the other line", "rtu", m.well, "another master|noise|stray|nothing was asked", "master|bias|other", "gap|power", events=((0.61, lambda s: b"\x31\x03\x00\x00\x00\x02\xc1\xfb\x31\x03"),)),
    Fault("long line: only 3 bytes come", "rtu ascii", m.sends(lambda x: x.reply[:3]), "break off", "wire|converter|buffer", OTHER),
    Fault("one byte of each reply wrong", "rtu ascii spa dcon", m.sends(lambda x: x.reply[:4] + bytes([x.reply[4] ^ 0x10]) + x.reply[5:]), "damaged|check value|cannot be read|no good", "check|bit rate|noise|wire|computes", "gap|second master|power"),
) + family(
    "a cheap converter",
    Fault("echoes the last byte", "rtu spa", m.sends(echoed_byte), "", "", well=True),
    Fault("sends FF before and behind", "rtu set", m.sends(lambda x: b"\xff\xff" + x.reply + b"\xff\xff"), "nothing was asked|noise", "bias|terminat", "gap|power|bit rate"),
    Fault("loses the second request of two", "rtu spa", m.needs_pause(0.06), "pause|too fast|soon", "quiet", OTHER + "|gap:"),
    Fault("16 ms buffer in pieces", "rtu spa ascii", m.pieces(6, 0.02), "", "", well=True),
    Fault("buffer of 32", "rtu", m.sends(m.at_most(32)), "break off|long|label", "less at once|buffer|points", OTHER, points=LONG),
    Fault("echo with noise", "rtu", lambda x: [(0.002, x.request[:3] + b"\xaa" + x.request[4:]), (0.03, x.reply)], "echo|stray|before its replies|another master", "echo|strip|bias|converter|master", "gap|power"),
    Fault("sends its reply twice now and then", "rtu spa dcon", m.now_and_then(m.twice), "twice", "serial server|radio|repeater", OTHER),
    Fault("00 in front of every reply", "dcon spa ascii", m.sends(m.before(b"\0")), "", "", well=True),
    Fault("mark parity", "spa", m.sends(lambda x: bytes(b | 0x80 for b in x.reply)), "eighth bit|data bits", "parity|data bits|7E1", "gap|second master|power"),
) + family(
    "a wrong manual",
    Fault("addresses from 1: not there", "rtu tcp", m.sends(m.exception(2)), "exception 02", "profile", OTHER),
    Fault("function 4, not 3", "rtu tcp ascii", m.of_request(b"\3\0\x0a", m.sends(m.exception(1))), "exception 01.*speed|speed.*exception 01", "profile|input", OTHER),
    Fault("reads one register at most", "rtu", m.of_request(b"\0\x28\0\2", m.sends(m.exception(3))), "exception 03.*torque|torque.*exception 03", "profile|less|block", OTHER),
    Fault("other address in replies: plus one", "rtu ascii tcp", m.sends(m.other_address(3)), "(slave|unit) 3 answers", "address", OTHER),
    Fault("broadcast address in replies", "rtu", m.sends(m.other_address(0)), "(slave )?0 answers", "address|firmware", OTHER),
    Fault("SPA slave 17 in place of 1", "spa", m.sends(m.other_address(17)), "slave 17 answers", "address", OTHER),
    Fault("DCON: engineering, percent set", "dcon", m.sends(m.dcon_line(lambda t: b">+100.00-050.00+000.00+099.99" if t[:1] == b">" else t)), "", "", well=True),
    Fault("DCON: other address", "dcon", m.sends(m.dcon_line(lambda t: b"!07" + t[3:] if t[:1] == b"!" else b"?07")), "module 07 answers|07", "address", OTHER),
    Fault("SPA: values in E notation", "spa", m.sends(m.spa_data(b"5.0E-1")), "5.0E-1|no number|type|no value", "profile|type", OTHER),
    Fault("meter asks for another password", "set", m.of_request(b"\1", m.sends(m.set_status(3))), "refuses the password", "correct `password`", OTHER),
    Fault("count in registers, not bytes", "rtu tcp", m.sends(m.pdu(lambda q: bytes([q[0], q[1] // 2 or 1]) + q[2:])), "count|not fit", "firmware|keep|profile", OTHER),
) + family(
    "a mis-set serial server",
    Fault("Modbus gateway mode: TCP frames", "rtu", m.sends(m.as_tcp), "modbus tcp", "modbus_tcp", OTHER, line="TCP"),
    Fault("raw mode behind modbus_tcp", "tcp", m.sends(lambda x: x.slave.wrap(x.address, x.slave.pdu(x.reply))), "modbus rtu", "modbus_rtu", OTHER),
    Fault("ASCII behind modbus_tcp", "tcp", m.sends(lambda x: m.as_ascii(x)), "modbus ascii", "modbus_ascii", OTHER),
    Fault("Telnet mode", "rtu spa", m.well, "telnet", "raw", "gap|power|bit rate", line="TCP", greeting=b"\xff\xfd\x03\xff\xfb\x00\xff\xfb\x01"),
    Fault("packs at 100 ms", "rtu spa", m.late(0.13), "", "", line="TCP", well=True),
    Fault("splits by 4 with 200 ms", "rtu spa ascii", m.pieces(4, 0.2), "pieces", "timing: \\{ gap", OTHER.replace("gap|", ""), line="TCP"),
    Fault("half its replies late by a second", "rtu", m.now_and_then(m.late(1.1), 2), "late|after the request", "timing: \\{ reply", "power|second master|bit rate", line="TCP"),
    Fault("banner on each connection, then well", "rtu", m.well, "", "", line="TCP", greeting=b"Connected to port 1\r\n", well=True),
    Fault("sends a heartbeat", "rtu spa", m.well, "text|by itself|nobody asked|nothing was asked", "heartbeat|take it off|automatic|off", OTHER, line="TCP", events=((1.9, lambda s: b"heartbeat 17\r\n"),)),
    Fault("other unit for all", "tcp", m.sends(m.other_address(0)), "unit 0 answers", "address|unit", OTHER),
    Fault("in use", "tcp", m.well, "before|at once|in use", "client|free", "gap|parity", refuses=True),
    Fault("says that it is in use, closes", "rtu", m.silent, "in use|text|already", "client|port", "gap|power|parity", line="TCP", greeting=b"Port already in use\r\n", drops=(0.8, 0)),
    Fault("serial port 9600 in place of 19200, beside nobody", "rtu", m.sends(m.wrong_rate(2.0)), "bit rate", "serial server", "gap|power|second master", line="TCP"),
) + family(
    "a PLC on the same bus",
    Fault("PLC polls another slave", "rtu ascii dcon spa set", m.well, "another master", "take the other|one master|away", "gap|power|bit rate", "alone beside", events=((0.77, lambda s: s.foreign()),)),
    Fault("PLC polls our slave, we hear the reply", "rtu", m.well, "another master|in addition to good replies", "master", OTHER, events=((0.91, lambda s: s.wrap(1, b"\3\4\0\1\0\2")),)),
    Fault("PLC and a silent device", "rtu dcon", m.silent, "another master", "take the other|one master|away", "gap|bit rate", events=((0.77, lambda s: s.foreign()),)),
    Fault("gateway is a slave's slave: other protocol on the bus", "rtu", m.well, "DCON", "line of its own|separate", "gap|power", events=((1.3, lambda s: b"$01M\r!017017\r"),)),
) + family(
    "a cloned address",
    Fault("cloned module", "dcon", m.two_in_turn, "two", "address", OTHER, "alone beside"),
    Fault("cloned, only now and then", "rtu spa", m.now_and_then(m.two_in_turn, 3), "two|second reply", "address", OTHER),
    Fault("cloned, in pieces of each", "rtu spa", lambda x: [(0.02, x.reply[:6]), (0.021, m.other_value(x)[:5]), (0.022, x.reply[6:] if x.number % 2 else x.reply[9:])], "two devices|damaged|no good", "address|two|check", "gap|second master|power"),
    Fault("cloned meter", "set", m.two_in_turn, "two|second reply", "address", OTHER),
) + family(
    "half dead",
    Fault("answers probes only", "spa", lambda x: m.well(x) if b"RF" in x.request else [], "answers|polls|single|no answer", "points|profile|quiet|poll|restart", "bit rate|second master"),
    Fault("always busy", "rtu tcp", m.sends(m.exception(6)), "exception 06", "programming|local|restart", OTHER + "|poll"),
    Fault("busy now and then", "rtu tcp", m.now_and_then(m.sends(m.exception(6))), "exception 06", "poll it less often", OTHER + "|programming"),
    Fault("restarts every 9 s for 3 s", "rtu spa tcp", m.by_time(m.silent, 9, 3), "stops answering|did not answer|outage|restart", "power|restart|wire", "gap|second master|bit rate"),
    Fault("slower and slower", "rtu tcp", m.growing(0.03), "late|after the request", "timing: \\{ reply", "power|second master|bit rate"),
    Fault("answers from its boot loader", "rtu spa", m.sends(m.only(b"Boot v1.2> ")), "text", "take it off|console|port", OTHER),
    Fault("all values zero, then dead", "rtu", after(12, m.silent), "offline for.*not a byte", "power|wire", "bit rate"),
    Fault("sends without end", "rtu spa", m.silent, "without an end|by itself", "unplug|stuck|take it off", "gap:|power", events=((0.02, lambda s: bytes(range(160, 200))),)),
    Fault("UU without end", "rtu", m.silent, "without an end|by itself", "unplug|stuck|take it off", "gap:|power", events=((0.02, lambda s: b"U" * 30),)),
    Fault("exception 04 on one request", "rtu tcp", m.of_request(b"\0\x28", m.sends(m.exception(4))), "exception 04", "fault of its own|restart|manual", OTHER),
    Fault("wrong function now and then", "rtu", m.now_and_then(m.sends(m.pdu(lambda q: bytes([q[0] ^ 4]) + q[1:]))), "function|not fit|other request", "firmware|keep|master|serial server", "gap|power|bit rate"),
    Fault("silent but for the first request", "rtu tcp spa", lambda x: m.well(x) if x.number == 0 else [], "not a byte comes any more|offline|not a byte", "power|wire|server|unit", "bit rate|second master"),
) + family(
    "as strangers tried it",
    Fault("each byte comes twice", "rtu spa dcon dcon0 ascii set", m.sends(lambda x: bytes(b for c in x.reply for b in (c, c))), "comes twice", "terminat|repeater", OTHER),
    Fault("single losses at random", "rtu spa dcon set", lambda x: m.well(x) if x.random.random() > 0.3 else [], "now and then a request gets no answer", "wire|plug|noise", "gap|stops answering|did not answer|restart|bit rate|quiet"),
    Fault("two of three requests lost", "rtu spa dcon", lambda x: m.well(x) if x.random.random() < 1 / 3 else [], "now and then a request gets no answer", "wire|plug|noise", "gap|stops answering|did not answer|restart|bit rate", "beside"),
    Fault("high bytes 11 swallowed", "rtu", m.sends(lambda x: high_bytes(x).replace(b"\x11", b"")), "11 are missing", "XON", OTHER, points=ROW),
    Fault("silent to one block", "rtu ascii", lambda x: [] if block_of(x) >= 500 else m.well(x), "does not answer the request for q.*holding 50", "take these points out", OTHER + "|away|noise", points=BLOCKS),
    Fault("Modbus master on the line", "dcon spa", m.well, "Modbus RTU", "line of its own|separate", OTHER, events=((0.77, lambda s: b"\x04\x03\x00\x00\x00\x02\xc4\x5e"),)),
    Fault("parity: 00 in place", "spa ascii", m.sends(lambda x: bytes(0 if bin(c).count("1") & 1 else c for c in x.reply)), "parity", "parity", "gap|second master|power"),
    Fault("parity: nothing but 00", "spa", m.sends(lambda x: bytes(len(x.reply))), "parity", "parity", "gap|second master|power"),
    Fault("no carriage return", "dcon dcon0", m.sends(lambda x: x.reply.replace(b"\r", b"")), "line end|last byte|carriage", "raw|converter", OTHER + "|first byte"),
    Fault("sum without its first character", "dcon", m.sends(lambda x: x.reply[:-3] + b"%02X\r" % ((int(x.reply[-3:-1], 16) - x.reply[0]) & 255)), "does not count the first character '[>!]'", "firmware|checksum: false", OTHER + "|first byte"),
    Fault("number with two values", "reader", None, "2 numbers", "read: number", "poll|gap|bit rate", device="form: text", points=WEIGHT, events=((0.7, lambda s: b"GS  12.35kg NT  10.10kg\r\n"),)),
    Fault("codes without an end", "reader", None, "no end", "end: \"\"", "poll|gap|bit rate", device="form: text, end: \"0x0D\"", points=WEIGHT, events=((1.7, lambda s: b"4006381333931"),)),
    Fault("nobody reads", "reader", None, "normal", "otherwise check", "poll", device="form: text", points=WEIGHT),
) + family(
    "as a blind test found them",
    Fault("all away 3 s of 14", "rtu spa", m.by_time(m.silent, 14, 3), "stops answering|did not answer", "supply|share|power", "less often|noise|gap", "both"),
    Fault("restarts every 15 s for 6 s", "spa rtu", m.by_time(m.silent, 15, 6), "stops answering|did not answer|outage", "power|restart|wire", "less often|noise|gap", "beside"),
    Fault("long replies in pieces", "rtu", m.pieces(16, 0.12), "pieces|pause", "timing: \\{ gap", "power|profile|take these points", points=LONG),
    Fault("the same bytes from 15 s on", "rtu tcp", after(15, m.stuck), "same reply", "restart", "profile|gap|power"),
    Fault("heartbeat of five letters", "rtu", m.well, "text", "take it off|automatic|heartbeat", "bias|gap|power", line="TCP", events=((3.0, lambda s: b"alive"),)),
    Fault("its port is in use", "rtu tcp", m.silent, "Port already", "other client|limit", "gap|power|port number", line="TCP", greeting=b"Port already in use\r\n"),
    Fault("one of twelve lost, polled fast", "rtu tcp", m.now_and_then(m.silent, 12), "now and then a request gets no answer", "wire|plug|network", "stops answering|did not answer|gap|restart", device="poll: 300ms"),
    Fault("exception 02 to all from 15 s on", "tcp rtu", after(15, m.sends(m.exception(2))), "exception 02", "firmware|device or its settings were changed", "gap|power"),
    Fault("two meters mixed", "set", m.collide, "two devices", "address", "ask for less|buffer|gap|power"),
)
