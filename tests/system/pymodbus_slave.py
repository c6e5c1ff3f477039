# A Modbus slave on a tty for the system tests, of pymodbus: an implementation that is not the project's.
# usage: pymodbus_slave.py rtu|ascii TTY UNIT[,UNIT...] [FIRST-LAST...]
# Of each unit U, register N holds 100 * U + N (holding) and 100 * U + N + 10000 (input), coil N is on
# when 3 divides N, discrete input N when 5 does. FIRST-LAST: only these holding registers exist.
# SPDX-License-Identifier: Apache-2.0
import asyncio
import sys

from pymodbus.datastore import (
    ModbusSequentialDataBlock,
    ModbusServerContext,
    ModbusSlaveContext,
    ModbusSparseDataBlock,
)
from pymodbus.device import ModbusDeviceIdentification
from pymodbus.server import StartAsyncSerialServer
from pymodbus.transaction import ModbusAsciiFramer, ModbusRtuFramer

SIZE = 1000


def holding_registers(unit, ranges):
    if not ranges:
        return ModbusSequentialDataBlock(0, [100 * unit + n for n in range(SIZE)])
    values = {}
    for text in ranges:
        first, last = map(int, text.split("-"))
        values.update({n: 100 * unit + n for n in range(first, last + 1)})
    return ModbusSparseDataBlock(values)


def slave(unit, ranges):
    return ModbusSlaveContext(
        co=ModbusSequentialDataBlock(0, [n % 3 == 0 for n in range(SIZE)]),
        di=ModbusSequentialDataBlock(0, [n % 5 == 0 for n in range(SIZE)]),
        hr=holding_registers(unit, ranges),
        ir=ModbusSequentialDataBlock(0, [100 * unit + n + 10000 for n in range(SIZE)]),
        zero_mode=True,
    )


async def main(framing, tty, units, *ranges):
    server = await StartAsyncSerialServer(
        context=ModbusServerContext(
            slaves={int(unit): slave(int(unit), ranges) for unit in units.split(",")}, single=False
        ),
        framer={"rtu": ModbusRtuFramer, "ascii": ModbusAsciiFramer}[framing],
        identity=ModbusDeviceIdentification(
            info_name={"VendorName": "Acme", "ProductCode": "M-7", "MajorMinorRevision": "2.5"}
        ),
        port=tty,
        baudrate=19200,
        ignore_missing_slaves=True,
        defer_start=True,
    )
    await server.start()
    if server.transport is None:
        sys.exit(f"{tty} cannot be opened")
    print("ready", flush=True)
    await server.serve_forever()


asyncio.run(main(*sys.argv[1:]))
