# SPDX-License-Identifier: Apache-2.0
"""The faults: one row each, on several protocols and in several places."""

import manners as m
import ports as p
from fault import ALL, BINARY, MODBUS, WIRE, Fault

FAULTS = [
    # Nothing comes.
    Fault("silent", ALL, m.silent, "not a byte|no (answer|reply)|silent", "power|wir|unit", "second master|gap", "alone beside"),
    Fault("both silent", "spa rtu", m.silent, "none of its 2 devices|not a byte", "port|wir|power", "", "both"),
    Fault("dead 4 s of 10", "spa dcon set rtu tcp", m.by_time(m.silent, 10, 4), "stops answering|did not answer|outage|comes and goes|restart", "power|wire|restart", "bit rate|gap"),
    Fault("every third lost", "spa dcon rtu", m.now_and_then(m.silent), "single|get no answer|lost|no answer", "noise|quiet|poll|wire", "bit rate", "alone"),
    # Bytes that are no replies.
    Fault("wrong bit rate", WIRE, m.sends(m.wrong_rate(0.5)), "bit rate", "bit rate|9600|19200", "second master|gap"),
    Fault("wrong bit rate, fast", "spa dcon rtu", m.sends(m.wrong_rate(2.0)), "bit rate", "bit rate|9600|19200", "second master|gap"),
    Fault("7E1 on 8N1", "spa ascii", m.sends(m.eighth_bit), "eighth bit|parity|data bits", "7E1|7O1", "gap"),
    Fault("garbage", ALL, m.sends(m.garbage), "bit rate|two devices|not modbus tcp", "bit rate|address|port|serial server|baud", "gap|power", "alone beside"),
    Fault("zeros", WIRE, m.sends(m.only(bytes(9))), "00|break", "A and B|driver|bias|bit rate", "gap"),
    Fault("babble", "spa set rtu", m.well, "by itself|noise|stray|without an end|bytes (stand|come)|text", "unplug|bias|take it off|terminat|switch", "gap",
          events=((0.15, lambda s: bytes(range(200, 240))),)),
    # Time.
    Fault("late beyond reply", "spa dcon set rtu ascii", m.late(0.75), "late|after the request|later than|slower", "timing: \\{ reply", "power|second master|bit rate"),
    Fault("late beyond reply", "tcp", m.late(1.6), "late|after the request|later than", "timing: \\{ reply", "power|second master|bit rate"),
    Fault("late now and then", "spa dcon set rtu", m.now_and_then(m.late(0.75)), "late|after the request|later than", "timing: \\{ reply", "power|second master|bit rate"),
    Fault("late beyond ceiling", "dcon rtu", m.late(6.0), "late|after the request|later than", "timing: \\{ reply", "second master|bit rate"),
    Fault("in pieces", WIRE, m.pieces(4, 0.12), "pieces|pause", "timing: \\{ gap", "power|second master|bit rate"),
    Fault("dribble", WIRE, m.pieces(1, 0.11), "pieces|pause", "timing: \\{ gap", "power|second master|bit rate"),
    Fault("pause of 400 ms now and then", WIRE, m.now_and_then(m.paused(0.4), 4), "pieces|pause", "timing: \\{ gap", "power|second master|bit rate"),
    Fault("slow device, fast neighbour", "spa dcon rtu", m.late(0.3), "takes .* of the line's time|ms per exchange", "poll", "power|raise the bit rate|noise", "beside",
          device="poll: 300ms, timing: { reply: 1s }", neighbour="poll: 300ms"),
    # Parts are missing.
    Fault("half replies", ALL, m.sends(m.half), "break off|half|stop", "buffer|wire|serial server|converter|ask for less", "bit rate|power|second master", "alone beside"),
    Fault("first byte eaten", WIRE, m.sends(m.head_lost), "first byte", "converter|direction|delay", "bit rate|power|gap|second master"),
    Fault("last byte lost", WIRE, m.sends(m.end_lost), "last byte|line end", "converter|direction|driver", "bit rate|power|gap|second master"),
    Fault("XON eaten", "rtu set", m.sends(m.eaten(0x11)), "missing|11|changes", "raw|XON", "power|second master"),
    Fault("0A eaten", "rtu", m.sends(m.eaten(0x0A, 3)), "missing|0A", "raw|line ends", "power|second master"),
    # The check value.
    Fault("check value wrong", ALL.replace(" tcp", ""), m.sends(m.bad_check), "check value|checksum", "checksum|another|address|two devices|computes", "gap|power|second master", "alone beside"),
    Fault("check value wrong, every 3rd", ALL.replace(" tcp", ""), m.now_and_then(m.sends(m.bad_check)), "damaged|check value|checksum", "noise|terminat|wire|two devices|ground", "gap|power|second master", "alone beside"),
    Fault("one bit", "spa rtu set", m.now_and_then(m.sends(m.one_bit), 3), "damaged|check", "noise|terminat|wire", "gap|second master"),
    Fault("check value swapped", BINARY, m.sends(m.crc_swapped), "high byte first|swapped|order", "firmware|converter|does not keep", "gap|power|bit rate"),
    Fault("no check value", "rtu", m.sends(lambda x: x.reply[:-2]), "no check value", "firmware|converter|does not keep", "gap|power|bit rate"),
    Fault("sum, not complement", "ascii", m.sends(lambda x: x.reply[:-4] + b"%02X" % (-int(x.reply[-4:-2], 16) & 255) + b"\r\n"), "sum|complement", "firmware|converter", "gap|power"),
    Fault("module without checksum", "dcon", m.sends(lambda x: x.reply[:-3] + b"\r"), "no checksum", "checksum: false", "gap|power|second master"),
    Fault("module with checksum", "dcon0", m.sends(lambda x: x.reply[:-1] + m_total(x.reply[:-1]) + b"\r"), "checksum", "checksum: true", "gap|power|second master"),
    Fault("sum in place of CRC", "set", m.sends(lambda x: x.reply[:-2] + bytes([255 ^ xor_of(x.reply[:-2])])), "sum of one byte", "checksum: ks", "gap|power"),
    # Somebody else.
    Fault("other address", "spa set rtu ascii tcp", m.sends(m.other_address(7)), "(slave|meter|unit) 7 answers", "address", "gap|power|bit rate", "alone beside"),
    Fault("second master", WIRE, m.well, "another master", "take the other|one master", "gap|power|bit rate",
          events=((0.9, lambda s: s.foreign()),)),
    Fault("two with one address", "spa dcon rtu ascii", m.sends(lambda x: b"".join(sorted([x.reply, changed(x)], key=lambda r: x.number % 2))), "two (different )?(devices|replies)|second", "address", "gap|power|bit rate"),
    Fault("twice", ALL.replace(" tcp", ""), m.twice, "twice|doubled", "serial server|radio|repeater|repeat", "gap|power|full|second master"),
    Fault("echo, device well", "spa dcon rtu ascii", m.echo(), "request itself came back|echo", "echo: strip", "gap|power|second master"),
    Fault("echo, device dead", WIRE, m.echo(m.silent), "only the request itself|echo", "echo: strip", "gap|second master"),
    # Around replies.
    Fault("noise before", WIRE, m.sends(m.noise_before), "come before|in front|noise", "bias|terminat|ground", "gap|power|second master"),
    Fault("noise behind", WIRE, m.sends(m.noise_behind), "follow|behind|noise", "bias|terminat|ground", "gap|power|second master"),
    Fault("DLE framing", WIRE, m.sends(m.dle_framed), "same|10 02|constant|each", "packet|framing|raw|modem|gateway", "bias|gap|power|second master"),
    Fault("registration packet", "rtu set spa", m.sends(m.before(b"\x7e\x00\x0bDTU0001\x7e")), "same|each|text|DTU", "packet|registration|heartbeat|raw|automatic output|take it off", "bias|gap|power|second master"),
    Fault("heartbeat", "rtu spa", m.well, "text|by itself", "take it off|automatic|heartbeat", "gap|power|second master", events=((2.5, lambda s: b"HEARTBEAT 00017\r\n"),)),
    # One request of several.
    Fault("one request silent", "rtu ascii tcp", m.of_request(b"\x00\x28", m.silent), "torque", "points|profile|access", "noise|bit rate"),
    Fault("one request silent", "spa", m.of_request(b"O2", m.silent), "trip", "points|profile|access", "noise|bit rate"),
    Fault("one request damaged", "rtu tcp", m.of_request(b"\x00\x28", m.sends(lambda x: x.reply[:-3] + b"\xAA\xAA\xAA" if x.slave.name == "modbus_rtu" else x.reply[:-1])), "torque", "points|profile|firmware|device", "bit rate"),
    Fault("one request damaged", "spa", m.of_request(b"O2", m.sends(m.bad_check)), "trip", "points|profile|firmware|device", "bit rate"),
    Fault("one request: not there", "rtu ascii tcp", m.of_request(b"\x00\x28", m.sends(m.exception(2))), "torque|illegal data address", "profile", "bit rate|noise"),
    # Modbus.
    *[Fault("exception %02X" % code, "rtu tcp" if code in (2, 4, 11) else "rtu", m.sends(m.exception(code)), "exception %02X" % code, cure, "gap|second master|bit rate")
      for code, cure in ((1, "profile"), (2, "profile"), (3, "profile"), (4, "fault of its own|restart"), (5, "programming|local|restart"), (6, "programming|local|restart"), (8, "fault of its own|restart|memory"),
                         (10, "behind|gateway"), (11, "behind|gateway"))],
    Fault("wrong function", MODBUS, m.sends(m.pdu(lambda q: bytes([q[0] ^ 4]) + q[1:])), "function|do(es)? not fit|other request", "firmware|keep to modbus|profile|server|master", "gap|power|bit rate"),
    Fault("fewer registers", MODBUS, m.sends(m.pdu(m.fewer_registers)), "short|fewer|count|not fit|bytes", "profile|firmware|keep", "gap|power|second master|bit rate"),
    Fault("more registers", MODBUS, m.sends(m.pdu(m.more_registers)), "long|more|count|not fit|bytes", "profile|firmware|keep", "gap|power|second master|bit rate"),
    Fault("count byte wrong", MODBUS, m.sends(m.pdu(m.wrong_count_byte)), "count|not fit", "profile|firmware|keep", "gap|power|second master|bit rate"),
    Fault("TCP bytes on RTU", "rtu", m.sends(m.as_tcp), "modbus tcp", "modbus_tcp", "gap|power|parity"),
    Fault("RTU bytes on TCP", "tcp", m.sends(lambda x: rtu_of(x)), "modbus rtu", "modbus_rtu", "gap|power|parity"),
    Fault("ASCII on RTU", "rtu", m.sends(lambda x: ascii_of(x)), "modbus ascii", "modbus_ascii", "gap|power|parity"),
    Fault("RTU on ASCII", "ascii", m.sends(lambda x: rtu_of(x)), "modbus rtu", "modbus_rtu", "gap|power"),
    Fault("transaction", "tcp", m.sends(lambda x: b"\0\7" + x.reply[2:]), "transaction", "firmware|serial server", "gap|power"),
    Fault("protocol number", "tcp", m.sends(lambda x: x.reply[:3] + b"\5" + x.reply[4:]), "protocol number", "firmware|serial server", "gap|power"),
    Fault("closes each time", "tcp", p.CLOSE, "connection", "client|server|unit|limit", "gap|parity"),
    # SPA.
    *[Fault("NAK %d" % code, "spa", m.sends(m.spa_nak(code)), "nak|nack|code %d|refus|%d" % (code, code), "profile|password|busy|poll|device|gateway", "gap|power|second master|bit rate") for code in (1, 4, 5, 7)],
    Fault("texts, no numbers", "spa", m.sends(m.spa_data(b"READY")), "READY|no number|text", "profile", "gap|power|second master|bit rate"),
    Fault("values missing", "spa", m.sends(m.spa_data(b"")), "sends nothing for them", "profile", "gap|power|second master|bit rate"),
    Fault("no colon", "spa", m.sends(lambda x: x.slave.wrap(x.address, b"D")), "form|syntax|cannot be read|not fit|damaged", "profile|firmware|protocol|device", "gap|power|second master"),
    # DCON.
    Fault("refuses (?)", "dcon dcon0", m.sends(lambda x: x.slave.wrap(b"?%02X" % x.address)), "\\?|refus|says no", "profile|command|channel", "gap|power|second master|bit rate"),
    Fault("channel count", "dcon dcon0", m.sends(m.dcon_line(lambda t: t[:-7] if t[:1] == b">" else t)), "3 values|channels|count", "channels|profile", "gap|power|second master|bit rate"),
    Fault("more channels", "dcon dcon0", m.sends(m.dcon_line(lambda t: t + b"+01.000" if t[:1] == b">" else t)), "5 values|channels|count", "channels|profile", "gap|power|second master|bit rate"),
    Fault("hex numbers", "dcon dcon0", m.sends(m.dcon_line(lambda t: b">7FFF7FFF7FFF7FFF" if t[:1] == b">" else t)), "hex|format", "format", "gap|power|second master|bit rate"),
    Fault("width", "dcon", m.sends(m.dcon_line(lambda t: b">+1.50+2.50+3.50+4.50" if t[:1] == b">" else t)), "width|characters|format|number", "width|profile|format", "gap|power|second master|bit rate"),
    # SET-4TM.
    Fault("wrong password", "set", lambda x: m.sends(m.set_status(3))(x) if x.request[1] == 1 else m.sends(m.set_status(5))(x), "password", "password", "gap|power|second master|bit rate"),
    Fault("channel closed always", "set", m.of_request(b"\x08", m.sends(m.set_status(5))), "channel|status 05|not open", "another|master|client|restart|password", "gap|power|bit rate"),
    Fault("status 01", "set", m.of_request(b"\x1B", m.sends(m.set_status(1))), "not allowed|status 01|do(es)? not know|not give", "profile", "gap|power|second master|bit rate"),
    Fault("internal error", "set", m.of_request(b"\x1B", m.sends(m.set_status(2))), "internal|status 02|error", "meter|restart|replace", "gap|power|second master|bit rate"),
    Fault("not ready", "set", m.of_request(b"\x1B", m.sends(m.set_status(7))), "not ready|status 07", "wait|meter|poll|later", "gap|power|second master|bit rate"),
    Fault("four bytes too few", "set", m.of_request(b"\x1B", m.sends(lambda x: x.slave.wrap(x.address, x.reply[1:-4]))), "short|fewer|length|bytes|not fit", "profile|meter", "gap|power|second master|bit rate"),
    # Ports.
    Fault("no such port", "rtu", None, "no such", "plugged|adapter|path", port=p.missing),
    Fault("a folder", "rtu", None, "directory|no serial|not a (serial|tty)", "port|path", port=p.folder),
    Fault("connection refused", "tcp", None, "refused", "port|server|number|run", port=p.refused),
    Fault("no host name", "tcp", None, "name|host|resolve", "name|DNS|spell|address", port=p.no_name),
    Fault("silent server", "tcp", m.silent, "not a byte|does not answer|no reply", "power|unit|server", "parity"),
    Fault("HTTP", "tcp rtu", m.sends(m.only(b"HTTP/1.1 400 Bad Request\r\nServer: x\r\n\r\n")), "web server", "port", "gap|power|parity", line="TCP"),
    Fault("SSH", "tcp rtu", m.silent, "SSH", "port", "gap|power|parity", line="TCP", greeting=b"SSH-2.0-OpenSSH_9.2\r\n"),
    Fault("TLS", "tcp", m.sends(m.only(b"\x15\x03\x01\x00\x02\x02\x16")), "TLS", "port", "gap|power|parity"),
    Fault("Telnet", "tcp", m.silent, "telnet", "port number", "gap|power|parity", greeting=b"\xff\xfd\x01\xff\xfb\x03\r\nlogin: "),
    Fault("Telnet", "rtu", m.silent, "telnet", "raw", "gap|power|parity", line="TCP", greeting=b"\xff\xfd\x01\xff\xfb\x03\r\nlogin: "),
    Fault("login", "tcp rtu set", m.silent, "login|text|console", "port|console|menu|take it off", "gap|power|parity", line="TCP", greeting=b"\r\nMOXA NPort 5110\r\nlogin: "),
    Fault("console", "rtu spa dcon", m.sends(m.only(b"\r\nsh: command not found\r\n# ")), "text|console", "console|port|take it off", "gap|power|second master"),
    Fault("modem", "rtu spa", m.sends(m.only(b"\r\nNO CARRIER\r\n")), "modem|NO CARRIER", "modem|port|take it off", "gap|power|second master"),
    Fault("silent reader", "reader", None, "sent nothing|silent", "normal|power", "wrong|bad", port=p.quiet_pty),
    Fault("reader, other bit rate", "reader", None, "damaged|bit rate|parity", "bit rate|parity|data bits", "poll", port=p.garbage_pty),
    # Nothing is wrong.
    *[Fault("well", "spa dcon dcon0 set rtu ascii tcp", m.well, "", "", where="alone beside", well=True) for _ in range(1)],
    Fault("well over a serial server", "spa dcon set rtu ascii", m.well, "", "", where="alone", line="TCP", well=True),
    Fault("well, 80 ms", "spa dcon set rtu ascii tcp", m.late(0.08), "", "", where="beside", well=True),
]


# Less usual ones.
FAULTS += [
    Fault("offline since a while", "spa dcon set rtu ascii tcp", m.dies_at(12), "offline for.*not a byte", "power|server", "bit rate|gap|second master", "alone beside"),
    Fault("both offline", "spa rtu", m.dies_at(12), "none of its 2 devices", "share|port|power", "", "both"),
    Fault("both damaged", "spa rtu", m.now_and_then(m.sends(m.bad_check)), "damaged", "noise|terminat|ground", "two devices", "both"),
    Fault("later each time", "spa rtu", m.growing(0.02), "late|after the request", "timing: \\{ reply", "bit rate|second master"),
    Fault("late replies of half", "dcon ascii", m.now_and_then(m.late(0.7), 2), "late|after the request", "timing: \\{ reply", "bit rate|second master"),
    Fault("one reply behind", "rtu spa", m.one_reply_behind, "previous request|other requests|earlier", "serial server|radio|cache|restart", "bit rate|gap"),
    Fault("copy 300 ms later", "spa rtu dcon", m.copy_after(0.3), "twice|again|second", "serial server|radio|repeater", "bit rate|gap|power"),
    Fault("A and B inverted", "spa rtu set", m.sends(m.inverted), "bit rate|A and B|no good frame", "bit rate|A and B", "gap|second master"),
    Fault("bits reversed", "rtu dcon", m.sends(m.reversed_bits), "no good frame|cannot be read", "bit rate|protocol", "gap|second master|power"),
    Fault("seven bits", "rtu set", m.sends(m.seven_bits), "data bits|eighth bit|seven", "data bits|8", "gap|second master|power"),
    Fault("lower case", "ascii", m.sends(m.lower_case), "", "", well=True),
    Fault("line ends changed", "spa ascii dcon", m.sends(m.newline_for_return), "line (feed|end)|0D|carriage", "raw", "gap|power|second master|bit rate"),
    Fault("XOFF inserted", "rtu set", m.sends(m.inserted(0x13)), "too many|damaged|changes|mixed", "raw|XON|converter", "gap|power|second master"),
    Fault("buffer of 6", "rtu set", m.sends(m.at_most(6)), "break off|missing|long replies", "buffer|wire|ask for less|converter", "gap|power|second master"),
    Fault("broken echo", "rtu spa", m.broken_echo, "echo|before its replies|same bytes|two masters", "echo|strip|raw|bias", "gap|power"),
    Fault("00 before each reply", "rtu spa", m.sends(m.before(b"\0\0\0\0")), "same bytes|come before", "raw|bias|terminat", "gap|power|second master"),
    Fault("CR LF behind each reply", "rtu set", m.sends(m.behind(b"\r\n\r\n")), "same bytes|follow", "raw|bias|terminat", "gap|power|second master"),
    Fault("AT modem frames", "rtu", m.sends(m.before(b"+IPD,0,7:")), "same bytes|text", "raw|modem|take it off", "gap|power|second master|bias"),
    Fault("NMEA", "rtu spa set", m.well, "text", "take it off|automatic", "gap|power|second master", events=((1.0, lambda s: b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M*47\r\n"),)),
    Fault("NMEA, silent device", "rtu spa set", m.silent, "text", "take it off|check the port", "gap|second master", events=((1.0, lambda s: b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M*47\r\n"),)),
    Fault("bursts of noise", "rtu spa dcon", m.well, "noise|stray|damaged|nothing was asked", "noise|bias|terminat|ground", "power|gap", events=((2.3, lambda s: bytes((i * 89 + 31) & 255 for i in range(60))),)),
    Fault("second master asks the same device", "rtu ascii", m.well, "another master|in addition to good", "take the other|another master", "gap|power|bit rate",
          events=((0.83, lambda s: s.wrap(1, b"\3\0\x50\0\2")), (0.83, lambda s: s.wrap(1, b"\3\4\0\1\0\2")))),
    Fault("busy now and then", "rtu tcp", m.now_and_then(m.sends(m.exception(6)), 4), "exception 06", "poll", "gap|second master|bit rate"),
    Fault("no target now and then", "rtu tcp", m.now_and_then(m.sends(m.exception(11)), 3), "exception 0B", "gateway", "gap|second master|bit rate"),
    Fault("unknown exception", "rtu", m.sends(m.exception(0x20)), "exception 20", "profile|manual|device", "gap|second master|bit rate"),
    Fault("refused without the exception bit", "rtu tcp", m.sends(m.pdu(lambda q: bytes([q[0], 2]))), "not fit|function or count|count|short|bytes", "firmware|profile|keep", "gap|second master|bit rate|power"),
    Fault("always the whole map", "rtu tcp", m.sends(m.pdu(lambda q: bytes([q[0], 40]) + bytes(40))), "count|not fit|bytes|long", "firmware|profile|keep", "gap|second master|bit rate|power"),
    Fault("one byte behind", "tcp", m.sends(m.behind(b"\0")), "header|bytes|not modbus", "firmware|serial server|port", "gap|power|bit rate"),
    Fault("unit 255 answers", "tcp", m.sends(m.other_address(255)), "unit 255 answers", "address|unit", "gap|power|bit rate"),
    Fault("MBAP in pieces", "tcp", m.paused(0.2), "", "", well=True),
    Fault("MBAP length too small", "tcp", m.sends(lambda x: x.reply[:5] + bytes([x.reply[5] - 1]) + x.reply[6:]), "header", "firmware|serial server", "gap|power"),
    Fault("not asked: pushes", "tcp", m.well, "transaction|nobody asked|unasked|nothing was asked|by itself|not modbus", "firmware|server|client|trace|raw", "gap|power|bit rate", events=((0.7, lambda s: b"\x77\x77\0\0\0\5\1\3\2\0\7"),)),
    Fault("SPA slave on Modbus", "rtu", m.sends(m.only(b"\n<1D:0.51/0.52:33\r\n")), "SPA|text", "spabus|protocol|port", "gap|power|bit rate"),
    Fault("DCON module on Modbus", "rtu", m.sends(m.only(b"?01\r")), "DCON|text|no good frame", "dcon|protocol|bit rate", "gap|power|second master"),
    Fault("Modbus on SPA", "spa", m.sends(lambda x: b"\1\x83\2\xc0\xf1"), "modbus|no good frame", "modbus|protocol", "gap|power|second master"),
    Fault("Modbus ASCII on DCON", "dcon", m.sends(lambda x: b":018302FA\r\n"), "modbus|no good frame|right form", "modbus|protocol", "gap|power|second master"),
    Fault("prompt", "dcon spa rtu", m.sends(m.only(b"\r\nCommand> ")), "text|console", "console|port|take it off", "gap|power|second master"),
    Fault("error text", "spa dcon", m.sends(m.only(b"ERROR: unknown command\r\n")), "text|console", "console|port|take it off", "gap|power|second master|bit rate"),
    Fault("ftp", "tcp set", m.silent, "mail or file server", "port", "gap|power|parity", line="TCP", greeting=b"220 ready\r\n"),
    Fault("mysql", "tcp", m.silent, "not modbus|text|server", "port", "gap|power|parity", line="TCP", greeting=b"J\0\0\0\n8.0.36\0\x08\0\0\0abcdefgh\0"),
    Fault("meter: too often", "set", m.now_and_then(m.sends(m.set_status(8)), 2), "busy|status 08", "poll", "gap|power|second master|bit rate"),
    Fault("meter: other address form", "set", m.sends(lambda x: x.slave.wrap(0xFC, bytes([0, 0x89, 0xA2, 0x61]) + x.reply[1:-2])), "meter", "address|serial_number", "gap|power|second master|bit rate"),
    Fault("host watchdog", "dcon", m.sends(lambda x: x.slave.wrap(b"!")), "watchdog|!|not fit|form|damaged", "watchdog|profile|module|~", "gap|power|second master"),
    Fault("no address checks", "spa", m.sends(lambda x: x.reply.replace(b"<1D", b"<D")), "form|slave|no good frame|damaged|check value", "address|device|protocol|profile|firmware|bit rate", "gap|power|second master"),
    Fault("every second silent", "spa tcp", m.now_and_then(m.silent, 2), "single|no answer", "noise|quiet|poll", "bit rate"),
    Fault("restarts", "rtu", m.by_time(m.silent, 20, 8), "stops answering|did not answer|outage|offline for.*outage", "restart|power|wire", "bit rate|gap|second master"),
]


FAULTS += [
    Fault("other parity, marked", "rtu set spa", m.sends(m.marked), "parity|bit rate", "parity|bit rate", "gap|power|second master"),
    Fault("bit rate a little off", "rtu set", m.sends(m.flipped), "damaged|bit rate|check value", "bit rate|noise|check|computes", "gap|power|second master"),
    Fault("now early, now late", "rtu dcon", m.between(0.1, 0.9), "late|after the request", "timing: \\{ reply", "bit rate|second master|power"),
    Fault("no coils", "rtu ascii", m.of_request(b"\1\0\5\0\1", m.silent), "\\bon\\b", "points|profile", "bit rate|noise"),
    Fault("no coils", "tcp", m.of_request(b"\1\0\5\0\1", m.silent), "\\bon\\b", "points|profile", "bit rate|noise"),
    Fault("fault now and then", "rtu tcp", m.now_and_then(m.sends(m.exception(4)), 3), "exception 04", "inspect|restart|replace", "gap|second master|bit rate"),
    Fault("answers twice", "tcp", m.twice, "twice|belong|nobody asked|nothing was asked", "firmware|client|server", "gap|parity|bias"),
    Fault("closes each fifth time", "tcp", m.now_and_then(p.CLOSE, 5), "connection", "client|server|limit|inactivity", "gap|parity"),
    Fault("reply of another command", "dcon", m.sends(lambda x: x.slave.wrap(b"!01" + x.reply[1:-3]) if x.reply[:1] == b">" else x.reply), "fit|form", "profile|module", "gap|power|second master|bit rate"),
    Fault("unknown NAK", "spa", m.sends(m.spa_nak(9)), "NACK 9", "device|manual", "gap|power|second master|bit rate"),
    Fault("numbers with commas", "spa", m.sends(lambda x: x.slave.wrap(x.address, x.slave.body_of(x.reply).replace(b".", b","))), "no value|number|fit|type", "profile", "gap|power|second master|bit rate"),
    Fault("numbers with commas", "dcon", m.sends(m.dcon_line(lambda t: t.replace(b".", b","))), "number|decimal point", "profile|format|module|set the device", "gap|power|second master|bit rate"),
    Fault("all FF", "rtu set", m.sends(lambda x: b"\xff" * len(x.reply)), "00 or FF", "A and B|bias|driver", "gap|second master"),
    Fault("one FF in front", "rtu set", m.sends(m.before(b"\xff")), "", "", well=True),
]


def m_total(text):
    return b"%02X" % (sum(text) & 0xFF)


def xor_of(data):
    value = 0
    for byte in data:
        value ^= byte
    return value


def changed(x):
    """The same with another value."""
    if x.slave.name.startswith("modbus"):
        q = x.slave.pdu(x.reply)
        return x.slave.with_pdu(x.request, q[:-1] + bytes([q[-1] ^ 1]))
    if x.slave.name == "spabus":
        return x.slave.wrap(x.address, x.reply.strip()[2:-3].replace(b"0", b"9")) if b"D:" in x.reply else x.reply
    return x.slave.wrap((x.reply[:-3] if x.slave.with_sum else x.reply[:-1]).replace(b"1", b"2")) if x.reply[:1] == b">" else x.reply


def rtu_of(x):
    import slaves
    return slaves.Rtu().wrap(x.address, x.slave.pdu(x.reply))


def ascii_of(x):
    import slaves
    return slaves.Ascii().wrap(x.address, x.slave.pdu(x.reply))
