# A Modbus master for the system tests, of pymodbus: an implementation that is not the project's.
# usage: pymodbus_master.py tcp|rtu PORT|TTY UNIT COMMAND[:NUMBER...]...    PORT: of 127.0.0.1
# Prints a JSON array with one result for each command: what was read, true for a confirmed write,
# {"exception": CODE}, or {"error": TEXT} without a good reply.
# SPDX-License-Identifier: Apache-2.0
import json
import sys

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.diag_message import ReturnQueryDataRequest
from pymodbus.exceptions import ModbusException
from pymodbus.mei_message import ReadDeviceInformationRequest
from pymodbus.register_read_message import ReadWriteMultipleRegistersRequest
from pymodbus.register_write_message import MaskWriteRegisterRequest
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer


def connect(framing, where):
    framer = {"tcp": ModbusSocketFramer, "rtu": ModbusRtuFramer}[framing]
    if where.startswith("/"):
        return ModbusSerialClient(where, framer=framer, baudrate=19200, timeout=2)
    return ModbusTcpClient("127.0.0.1", int(where), framer=framer, timeout=2)


def ask(client, unit, name, numbers):
    def read_write(first, count, to, *values):
        return client.execute(
            ReadWriteMultipleRegistersRequest(
                read_address=first, read_count=count, write_address=to, write_registers=values, unit=unit
            )
        )

    def mask(address, keep, add):
        return client.execute(MaskWriteRegisterRequest(address, keep, add, unit=unit))

    return {
        "coils": lambda first, count: client.read_coils(first, count, unit),
        "discrete": lambda first, count: client.read_discrete_inputs(first, count, unit),
        "holding": lambda first, count: client.read_holding_registers(first, count, unit),
        "input": lambda first, count: client.read_input_registers(first, count, unit),
        "coil": lambda address, value: client.write_coil(address, bool(value), unit),
        "register": lambda address, value: client.write_register(address, value, unit),
        "write_coils": lambda first, *values: client.write_coils(first, [bool(v) for v in values], unit),
        "write_registers": lambda first, *values: client.write_registers(first, list(values), unit),
        "mask": mask,
        "read_write": read_write,
        "loopback": lambda value: client.execute(ReturnQueryDataRequest(value, unit=unit)),
        "identity": lambda: client.execute(ReadDeviceInformationRequest(1, 0, unit=unit)),
    }[name](*numbers)


def result(client, unit, command):
    name, *numbers = command.split(":")
    numbers = [int(number) for number in numbers]
    try:
        reply = ask(client, unit, name, numbers)
    except ModbusException as trouble:
        return {"error": str(trouble)}
    if not hasattr(reply, "function_code"):
        return {"error": str(reply)}
    if reply.isError():
        return {"exception": reply.exception_code}
    if hasattr(reply, "information"):
        return {str(key): text.decode() for key, text in reply.information.items()}
    if hasattr(reply, "registers"):
        return reply.registers
    if hasattr(reply, "bits") and name in ("coils", "discrete"):
        return [int(bit) for bit in reply.bits[: numbers[1]]]
    return getattr(reply, "message", True)


framing, where, unit, *commands = sys.argv[1:]
master = connect(framing, where)
if not master.connect():
    sys.exit(f"{where} cannot be opened")
print(json.dumps([result(master, int(unit), command) for command in commands]))
