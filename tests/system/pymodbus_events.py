# Reads the events of a unit (registers 9016 to 9095) with pymodbus while they go on: an implementation that is not the
# project's. usage: pymodbus_events.py PORT UNIT FIRST LAST
# From FIRST on until LAST has been seen, then prints {"numbers": [...], "lost": N, "codes": [...], "oldest": [...],
# "wrong": [...]}.
# SPDX-License-Identifier: Apache-2.0
import json
import sys
import time

from pymodbus.client import ModbusTcpClient
from pymodbus.transaction import ModbusSocketFramer


def u32(words, at):
    return words[at] << 16 | words[at + 1]


port, unit, first, last = [int(word) for word in sys.argv[1:]]
client = ModbusTcpClient("127.0.0.1", port, framer=ModbusSocketFramer, timeout=5)
if not client.connect():
    sys.exit("no connection")
told = {"numbers": [], "codes": [], "oldest": [], "lost": 0, "wrong": []}
until = time.monotonic() + 60
while time.monotonic() < until and (not told["numbers"] or told["numbers"][-1] < last):
    reply = client.write_registers(9016, [first >> 16, first & 0xFFFF], unit)
    if reply.isError():
        sys.exit(f"writing: {reply}")
    reply = client.read_input_registers(9016, 80, unit)
    if reply.isError():
        sys.exit(f"reading: {reply}")
    words = reply.registers
    count = words[8]
    if u32(words, 0) != first or count > 7 or u32(words, 2) < u32(words, 4):
        told["wrong"].append(words[:10])
    told["lost"] += u32(words, 6)
    if not told["oldest"] or told["oldest"][-1] != u32(words, 4):
        told["oldest"].append(u32(words, 4))
    for at in range(10, 10 + 10 * count, 10):
        told["numbers"].append(u32(words, at))
        told["codes"].append(u32(words, at + 7))
    if any(words[10 + 10 * count :]):
        told["wrong"].append(words)
    first = told["numbers"][-1] + 1 if count == 7 else max(first, u32(words, 2) + 1)
print(json.dumps(told))
