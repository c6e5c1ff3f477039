# SPDX-License-Identifier: Apache-2.0
"""Faults as they are met on sites, in families: what a tester found that was named half, wrongly or not at all."""

import manners as m
import ports as p
from fault import MODBUS, WIRE, Fault, family

OTHER = "gap|second master|power|bit rate"
SERIAL_WORDS = "adapter|A and B|bias|terminat|parity|bit rate|data bits"
TAG = b"\r\n-06001259E3\r\n>"
TAG2 = b"\r\n-0600125A17\r\n>"
LONG = ("{ name: speed, read: holding 10, type: uint16 }", "{ name: heat, read: input 3, type: uint16 }",
        "{ name: label, read: holding 100, type: string(60) }")
WEIGHT = ("{ name: weight, read: number, type: float32 }",)


def tags(change=lambda tag: tag, every=1.0):
    numbers = iter(range(10**9))
    return ((every, lambda s: change((TAG, TAG2)[next(numbers) // 4 % 2])),)


def lines(*texts, every=1.0):
    numbers = iter(range(10**9))
    return ((every, lambda s: texts[next(numbers) % len(texts)]),)


def sentence(body, taken=0):
    """With its check value, changed by `taken`."""
    total = taken
    for byte in body:
        total ^= byte
    return b"$%s*%02X\r\n" % (body, total)


WIND, GPS = b"WIMWV,045,R,011.63,N,A", b"GPRMC,063905,A,4717.1,N,00833.9,E,0.0,0.0,281126,,"
MDA = b"WIMDA,29.9870,I,1.0154,B,21.2,C,,C,43.5,,8.4,C,347.1,T,351.0,M,4.9,N,2.5,M"
WEATHER = {"profile": "nmea-0183-weather"}
SCALE = {"profile": "mt-sics"}


def both(every=1.0, **changed):
    return tuple((every, lambda s, body=body: sentence(body, **changed)) for body in (WIND, MDA))


SITES = family(
    "1 SPA, one thing wrong",
    Fault("LF counted", "spa", m.sends(m.lf_counted), "line feed|LF", "lf_in_checksum: true", OTHER, "alone beside"),
    Fault("XX, and none is taken", "spa", m.sends(m.spa_wildcard), "XX", "accept_xx: true", OTHER, "alone beside", device="accept_xx: false"),
    Fault("XX", "spa", m.sends(m.spa_wildcard), "", "", well=True),
    Fault("LF in place of CR", "spa", m.sends(lambda x: x.reply.replace(b"\r", b"\n")), "line (feed|end)|carriage", "raw", OTHER, "alone beside"),
    Fault("LF CR", "spa", m.sends(lambda x: x.reply.replace(b"\r\n", b"\n\r")), "line feed", "raw", OTHER),
    Fault("no CR, no LF", "spa", m.sends(lambda x: x.reply.rstrip()), "last byte|line end|carriage", "raw|converter|driver", OTHER),
    Fault("first 2 lost", "spa", m.sends(lambda x: x.reply[2:]), "first (byte|.* bytes)", "converter|direction|delay", OTHER),
    Fault("first 3 lost", "spa", m.sends(lambda x: x.reply[3:]), "first (byte|.* bytes)", "converter|direction|delay", OTHER, "alone beside"),
    Fault("first 4 lost", "spa", m.sends(lambda x: x.reply[4:]), "first (byte|.* bytes)", "converter|direction|delay", OTHER),
    Fault("no check value", "spa", m.sends(lambda x: x.reply[:-4] + b"\r\n"), "no check", "firmware|converter|device|XX", OTHER),
    Fault("check value over all but <", "spa", m.sends(lambda x: m.spa_check(x, 0x3C)), "check value|checksum", "checksum|computes|firmware", OTHER),
) + family(
    "2 connection lost",
    Fault("dropped each 4 s", "tcp rtu", m.well, "connection", "serial server|server|inactivity|power|restart", "parity|A and B", "alone beside", line="TCP", drops=(4, 0)),
    Fault("server restarts", "tcp rtu spa", m.well, "connection|refused", "serial server|server|power|restart", "parity|A and B", "alone", line="TCP", drops=(5, 1.5)),
    Fault("dropped each 3 s, silent", "rtu", m.silent, "connection", "serial server|server|power|unit|address", "parity", line="TCP", drops=(3, 0)),
    Fault("dropped each 6 s, slow", "tcp", m.late(0.3), "connection", "server|inactivity|power|restart", "parity|A and B", line="TCP", drops=(6, 0)),
    Fault("closes behind each answer", "tcp rtu", lambda x: m.well(x) + [(m.THINK + 0.001, p.CLOSE)], "", "", line="TCP", well=True),
) + family(
    "3 closes behind the request",
    Fault("closes behind the request", "tcp", p.CLOSE, "clos(ed?|es) the connection", "unit|protocol|device|Modbus", "another client|parity|gap", "alone beside"),
    Fault("closes behind the request", "rtu spa dcon", p.CLOSE, "clos(ed?|es) the connection", "protocol|mode|raw|speak", "another client|parity|gap", line="TCP"),
    Fault("closes at once", "tcp rtu", m.well, "before|at once", "client|limit|free", "parity|gap", line="TCP", refuses=True),
) + family(
    "4 data bits over a serial server",
    Fault("7E1 in place of 8N1", "spa ascii", m.sends(m.eighth_bit), "eighth bit|parity|data bits", "serial server", "set serial|" + "gap|power", "alone beside", line="TCP"),
    Fault("7 bits in place of 8", "rtu set", m.sends(m.seven_bits), "data bits|eighth bit", "serial server", "set serial|gap|power|second master", "alone", line="TCP"),
    Fault("7O1 in place of 8N1", "spa", m.sends(lambda x: bytes(c | (~bin(c).count("1") & 1) << 7 for c in x.reply)), "eighth bit|parity|data bits", "serial server", "set serial|gap|power", line="TCP"),
    Fault("other bit rate", "rtu spa dcon", m.sends(m.wrong_rate(0.5)), "bit rate", "serial server", "gap|power|second master", line="TCP"),
) + family(
    "5 readers",
    Fault("well", "reader", None, "", "", events=tags(), well=True),
    Fault("no tag yet", "reader", None, "", "", events=tags(lambda t: b"\r\n-0000000000\r\n>"), well=True),
    Fault("7E1 on 8N1", "reader", None, "eighth bit|7 data bits", "7E1|7O1", "poll|gap", events=tags(lambda t: m.even(t))),
    Fault("7E1 on 8N1, TCP", "reader", None, "eighth bit|7 data bits", "serial server", "poll|gap|set serial", line="TCP", events=tags(lambda t: m.even(t))),
    Fault("LF only", "reader", None, "line (feed|end)", "raw|converter|reader", "poll|gap|bit rate", events=tags(lambda t: t.replace(b"\r\n", b"\n"))),
    Fault("texts, no tags", "reader", None, "text.*(4006381333931|'4)", "form: text|profile", "poll|gap|bit rate", events=lines(b"4006381333931\r\n")),
    Fault("minus behind", "reader", None, r"12\.35-", "profile|number|indicator|format|options", "poll|gap|bit rate", device="form: text", points=WEIGHT, events=lines(b"ST,GS,  12.35-kg\r\n")),
    Fault("OL", "reader", None, "OL", "overload|profile|indicator|number", "poll|gap|bit rate", device="form: text", points=WEIGHT, events=lines(b"    OL\r\n")),
    Fault("OL now and then", "reader", None, "OL", "overload|profile|indicator|number", "poll|gap|bit rate", device="form: text", points=WEIGHT, events=lines(b"ST,GS,+  12.35kg\r\n", b"OL,GS,+       kg\r\n", b"OL,GS,+       kg\r\n")),
    Fault("silent with max_age", "reader", None, "spoken|silent|nothing", "power|wire|wiring|cable", "poll", device="form: text, max_age: 3s", points=WEIGHT, events=((4.0, lambda s: b""),)),
    Fault("silent since a while, max_age", "reader", None, "silent|nothing", "power|wire|wiring|cable", "poll", device="form: text, max_age: 3s, dead_age: 6s", points=WEIGHT, events=((1.0, m.until(12, b"ST,GS,+  12.35kg\r\n")),)),
    Fault("other bit rate", "reader", None, "bit rate", "bit rate", "poll|gap", events=tags(lambda t: m.sampled(t, 0.5, 8, ""))),
    Fault("first byte lost", "reader", None, "first byte|damaged", "converter|direction|noise|wire", "poll|gap|bit rate", device="form: text, start: \"0x02\", end: \"0x03\"", points=WEIGHT, events=lines(b"ST,GS,+  12.35kg\x03")),
    Fault("other end", "reader", None, "end|too long|longer", "end", "poll|gap|bit rate", device="form: text, start: \"0x02\", end: \"0x03\"", points=WEIGHT, events=lines(b"\x02ST,GS,+  12.35kg\r\n")),
    Fault("damaged now and then", "reader", None, "damaged", "noise|wire", "poll|gap", events=tags(lambda t, n=iter(range(10**9)): t[:7] + b"\xf3" + t[8:] if next(n) % 3 == 0 else t)),
    Fault("login prompt", "reader", None, "login", "getty|port", "noise|bit rate", device="form: text", points=WEIGHT, events=lines(b"\r\nDebian GNU/Linux 12 hall ttyS0\r\n\r\nhall login: ", every=3.0)),
    Fault("letters beyond ASCII", "reader", None, "beyond ASCII", "ASCII", "7E1|parity", device="form: text", events=lines(b"Kunde M\xfcller 12\r")),
    Fault("NMEA", "reader", None, "NMEA", "port", "numbers|bit rate", device="form: text", points=WEIGHT, events=lines(sentence(GPS))),
    Fault("characters lost", "reader", None, "characters are missing", "wire|buffer|flow", "carriage|set length", device="form: text, length: 13", events=lines(b"4012300000166\r", b"401230000016\r", b"40123000016\r")),
    Fault("another length", "reader", None, "have 8 characters", "length", "carriage|missing", device="form: text, start: \"]\", length: 13", events=lines(b"]40121443\r")),
    Fault("Telnet at the beginning", "reader", None, "Telnet", "raw", "power", line="TCP", greeting=b"\xff\xfb\x01\xff\xfb\x03", events=tags()),
) + family(
    "5b telegrams",
    Fault("well", "nmea", None, "", "", events=both(), well=True, **WEATHER),
    Fault("well", "balance", m.well, "", "", well=True, **SCALE),
    Fault("stable and not, in turn", "balance", m.now_and_then(m.sends(lambda x: x.reply.replace(b"S S", b"S D")), 4), "", "", well=True, **SCALE),
    Fault("decimal comma", "balance", m.sends(lambda x: x.reply.replace(b".", b",")), "decimal comma", "decimal point", "noise", **SCALE),
    Fault("no MDA", "nmea", None, "no MDA", "switch the message on", "power", events=both()[:1], **WEATHER),
    Fault("GPS receiver", "nmea", None, r"GPRMC", "device is at this port", "power", events=lines(sentence(GPS)), **WEATHER),
    Fault("every 15 s", "nmea", None, "every 15", "max_age", "power|wire", device="poll: 2s", events=both(15.0), **WEATHER),
    Fault("check value with the $", "nmea", None, "computed in another way", "checksum:", "multiplexer|noise", events=both(taken=0x24), **WEATHER),
    Fault("check value differs by 41", "nmea", None, "computed in another way", "differs from xor8 always by 41", "multiplexer|noise", events=both(taken=0x41), **WEATHER),
) + family(
    "6 damage by content or length",
    *[Fault("%02X swallowed" % byte, "rtu set", m.sends(m.valued(byte, lambda r, b=byte: r.replace(bytes([b]), b""))), "missing|%02X|break off" % byte, "raw|XON|flow control|line ends|serial server", "power|second master|bit rate", line="TCP" if byte else "")
      for byte in (0x11, 0x13, 0x0D)],
    Fault("00 swallowed", "rtu set", m.sends(lambda x: x.reply.replace(b"\0", b"")), "00", "raw|converter|serial server", OTHER),
    Fault("0A to 0D 0A", "rtu set", m.sends(m.valued(0x0A, lambda r: r.replace(b"\n", b"\r\n"))), "0A|0D|too many", "raw|line ends", OTHER),
    Fault("0D to 0A", "rtu set", m.sends(m.valued(0x0D, lambda r: r.replace(b"\r", b"\n"))), "0D|0A|check value|damaged", "raw|line ends", OTHER),
    Fault("0A to 0D", "rtu set", m.sends(m.valued(0x0A, lambda r: r.replace(b"\n", b"\r"))), "0D|0A|check value|damaged", "raw|line ends", OTHER),
    Fault("FF doubled", "rtu set", m.sends(m.valued(0xFF, lambda r: r.replace(b"\xff", b"\xff\xff"))), "FF", "Telnet|raw", OTHER, line="TCP"),
    Fault("03 ends the reply", "rtu", m.sends(m.valued(0x03, lambda r: r[:2] + r[2:].split(b"\x03")[0])), "break off|missing|03", "raw|serial server|buffer", OTHER, line="TCP"),
    Fault("long replies damaged", "rtu ascii", m.sends(lambda x: x.reply[:50] + b"\x55" * (len(x.reply) - 50) if len(x.reply) > 50 else x.reply), "long|label", "less at once|buffer|points", "power|second master|bit rate", points=LONG),
    Fault("long replies lose bytes", "rtu ascii tcp", m.sends(lambda x: x.reply[:40] + x.reply[44:] if len(x.reply) > 50 else x.reply), "long|label", "less at once|buffer|points", "power|second master|bit rate", points=LONG),
    Fault("long replies cut", "rtu ascii tcp", m.sends(lambda x: x.reply[:64]), "long|label|break off", "less at once|buffer|points", "power|second master|bit rate", points=LONG),
    Fault("long lists damaged", "spa", m.sends(lambda x: x.reply[:16] + b"?" + x.reply[17:] if len(x.reply) > 20 else x.reply), "long|current_l1", "less at once|max_items|buffer|points", "power|second master|bit rate"),
    Fault("one byte missing", "ascii spa dcon", m.sends(lambda x: x.reply[:len(x.reply) // 2] + x.reply[len(x.reply) // 2 + 1:]), "missing|too few|one character|check value", "converter|raw|serial server", OTHER),
    Fault("one byte missing now and then", "ascii spa dcon rtu", m.now_and_then(m.sends(lambda x: x.reply[:len(x.reply) // 2] + x.reply[len(x.reply) // 2 + 1:])), "missing|too few|damaged|one character", "converter|raw|serial server|noise", "gap|second master|power|bit rate"),
) + family(
    "7 a stuck cache",
    Fault("the same bytes always", "spa dcon set rtu ascii tcp", m.stuck, "same (bytes|reply)", "serial server|cache|gateway|restart", "gap|power|bit rate|second master|another master"),
    Fault("the same PDU always", "tcp", m.stuck_pdu, "same (bytes|reply)|not fit|function or count", "server|cache|gateway|restart|profile", "gap|power|bit rate|another master"),
) + family(
    "8 one beside a healthy one",
    Fault("inverted", "spa set rtu dcon", m.sends(m.inverted), "A and B|inverted|swapped", "A and B|swap", "gap|second master|noise", "beside"),
    Fault("its own bit rate", "spa set rtu dcon ascii", m.sends(m.wrong_rate(0.5)), "bit rate", "bit rate", "gap|second master|noise", "beside"),
    Fault("its own parity", "rtu set spa", m.sends(m.marked), "parity", "parity", "gap|second master|noise|power", "beside"),
    Fault("7E1", "spa ascii", m.sends(m.eighth_bit), "eighth bit|parity|data bits", "7E1|7O1|settings", "gap|second master|noise|power", "beside"),
    Fault("two with one address collide", "rtu set ascii spa dcon", m.collide, "two devices", "address", "gap|power", "alone beside"),
    Fault("two with one address, one behind the other", "rtu set ascii dcon", m.two_in_turn, "two (different )?(devices|replies)|second reply", "address", "gap|power|bit rate", "alone beside"),
) + family(
    "9 two SPA relays",
    Fault("two relays in turn", "spa", m.two_in_turn, "two (different )?(devices|replies)|second reply", "address", "come twice|gap|power|bit rate", "alone beside"),
    Fault("two relays, alike but for currents", "spa", m.two_alike, "two (different )?(devices|replies)|second reply", "address", "come twice|gap|power|bit rate", "alone beside"),
    Fault("two meters, alike but for one value", "rtu", m.two_alike, "two (different )?(devices|replies)|second reply", "address", "come twice|gap|power|bit rate", "alone"),
) + family(
    "10 a pause before the next request",
    Fault("needs 120 ms", "rtu spa dcon ascii", m.needs_pause(0.12), "pause|too fast|quick|soon", "quiet", "power|second master|bit rate|gap:", "alone beside"),
    Fault("needs 300 ms", "rtu", m.needs_pause(0.3), "pause|too fast|quick|soon", "quiet", "power|second master|bit rate|gap:", "alone"),
) + family(
    "11 another profile, address or protocol",
    Fault("2A module, 8A profile", "dcon", m.sends(m.mv110(2)), "2 values", "owen-mv110-2a|profile|channels", OTHER, profile="owen-mv110-8a"),
    Fault("8A module, 2A profile", "dcon", m.sends(m.mv110(8)), "8 values", "owen-mv110-8a|profile|channels", OTHER, profile="owen-mv110-2a"),
    Fault("8A module", "dcon", m.sends(m.mv110(8)), "", "", profile="owen-mv110-8a", well=True),
    Fault("short address asked by number", "setx", m.sends(lambda x: x.slave.wrap(b"\x14", x.reply[5:-2])), "meter 20 answers", "address", OTHER),
    Fault("silent to its number", "setx", m.silent, "not a byte", "address", "second master|gap"),
    Fault("0A", "tcp", m.sends(m.exception(10)), "exception 0A", "route|gateway.*(unit|path|port)|path", "gap|second master|bit rate|profile"),
    Fault("0B", "tcp", m.sends(m.exception(11)), "exception 0B", "behind.*(power|address|wire)|power|address", "gap|second master|bit rate|profile"),
    Fault("IEC 104 greets", "tcp", m.silent, "60870|IEC 104", "port", "gap|power|parity", greeting=b"\x68\x04\x43\x00\x00\x00"),
    Fault("IEC 104 answers", "tcp", m.sends(m.only(b"\x68\x04\x0b\x00\x00\x00")), "60870|IEC 104", "port", "gap|power|parity"),
    Fault("IEC 104 every 5 s", "tcp", m.silent, "60870|IEC 104", "port", "gap|power|parity", events=((5.0, lambda s: b"\x68\x04\x43\x00\x00\x00"),)),
    Fault("HTTP in pieces", "tcp rtu", lambda x: [(0.02, b"HTTP"), (0.05, b"/1.1 400 Bad Request\r\n\r\n")], "web server", "port", "gap|power|parity", line="TCP"),
    Fault("HTTP closes", "tcp", lambda x: [(0.02, b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n"), (0.021, p.CLOSE)], "web server", "port", "gap|power|parity"),
    Fault("SSH beside", "tcp", m.silent, "SSH", "port", "gap|power|parity", greeting=b"SSH-2.0-dropbear_2019.78\r\n"),
    Fault("Telnet menu", "spa dcon", m.silent, "telnet|text", "raw|port", "gap|power|parity", line="TCP", greeting=b"\xff\xfb\x01\xff\xfb\x03\xff\xfd\x18\r\nPress Enter for Setup Mode\r\n"),
    Fault("S7", "tcp", m.sends(m.only(b"\x03\x00\x00\x16\x11\xd0\x00\x01\x00\x02\x00\xc0\x01\x0a\xc1\x02\x01\x00\xc2\x02\x01\x02")), "S7|ISO|61850|TPKT", "port", "gap|power|parity"),
    Fault("DNP3", "tcp rtu", m.sends(m.only(b"\x05\x64\x05\xc0\x01\x00\x0a\x00\x8f\x9c")), "DNP3", "port|protocol", "gap|power|parity", line="TCP"),
) + family(
    "13 tried again",
    Fault("away for 0.3 s", "rtu spa tcp", m.by_time(m.silent, 13, 0.3), "", "", well=True),
    Fault("echo", "tcp", m.echo(m.silent), "request itself", "port|service", SERIAL_WORDS),
    Fault("noise before", "tcp", m.sends(m.noise_before), "not modbus|header|damaged|stray|nobody asked", "server|port|firmware", SERIAL_WORDS),
    Fault("noise behind", "tcp", m.sends(m.noise_behind), "not modbus|header|damaged|stray|nobody asked|bytes", "server|port|firmware", SERIAL_WORDS),
    Fault("noise by itself", "tcp", m.well, "nobody asked|unasked|nothing was asked|not modbus|by itself|damaged", "server|port|firmware", SERIAL_WORDS, events=((2.3, lambda s: bytes((i * 89 + 31) & 255 for i in range(60))),)),
    Fault("zeros", "tcp", m.sends(m.only(bytes(12))), "not modbus|00", "port|server", SERIAL_WORDS),
    Fault("one healthy device of each", "spa dcon dcon0 set rtu ascii tcp", m.well, "", "", where="alone beside", well=True),
    Fault("healthy over a serial server", WIRE, m.late(0.05), "", "", where="alone beside", line="TCP", well=True),
    Fault("healthy, quick", "spa dcon set rtu ascii tcp", m.late(0.003), "", "", where="beside", well=True),
    Fault("healthy, not regular", "spa dcon set rtu ascii tcp", m.between(0.01, 0.09), "", "", where="beside", well=True),
) + family(
    "14 texts, refusals and pauses",
    Fault("login prompt behind each request", "rtu spa dcon", m.sends(m.only(b"\r\nDebian GNU/Linux 11 plc7 ttyS0\r\n\r\nplc7 login: ")), "login", "getty|console", "by itself|gap|power"),
    Fault("HB0001", "rtu", m.well, "HB0001", "heartbeat", "bias|terminat|gap|power", line="TCP", events=((2.5, lambda s: b"HB0001"),)),
    Fault("blank before, OK behind", "ascii", m.sends(lambda x: b" " + x.reply + b"OK\r\n"), "same text", "raw", "by itself|gap|power"),
    Fault("mark parity", "dcon", m.sends(lambda x: bytes(c | 0x80 for c in x.reply)), "eighth bit", "7M1|7N2", "7E1|7O1|gap|power"),
    Fault("refuses all since 12 s", "dcon", m.dies_at(12, m.sends(lambda x: x.slave.wrap(b"?01"))), r"\?01", "answered before", "profile|gap|bit rate"),
    Fault("refuses all since 12 s", "rtu tcp", m.dies_at(12, m.sends(m.exception(2))), "exception 02", "answered before", "profile|gap|bit rate"),
    Fault("needs 400 ms", "rtu", m.needs_pause(0.4), "soon", "quiet.*\\b([5-9]|1\\d)\\d0ms", "second master|bit rate|gap:"),
    Fault("one register fewer", MODBUS, m.sends(m.pdu(m.fewer_registers)), "fewer registers", "block", "profile|gap|power"),
    Fault("one value fewer", "spa", m.sends(lambda x: x.slave.wrap(x.address, x.slave.body_of(x.reply).rsplit(b"/", 1)[0])), "values instead of", "max_items", "gap|power|bit rate"),
)
