# SPDX-License-Identifier: Apache-2.0
"""One fault: where it is tried, how the slave behaves, and what has to be said of it.

`says` and `cure` are what the first sentence has to name (regular expressions, without regard to case), `never` what it may not say.
`where`: alone on the line, beside a healthy neighbour, or two devices alike (both).
"""

import dataclasses

ALL = "spa dcon set rtu ascii tcp"
WIRE = "spa dcon set rtu ascii"
TEXT = "spa dcon ascii"
BINARY = "set rtu"
MODBUS = "rtu ascii tcp"


@dataclasses.dataclass
class Fault:
    name: str
    on: str
    how: object
    says: str
    cure: str
    never: str = ""
    where: str = "alone"
    device: str = ""          # options of the device
    neighbour: str = ""       # of the healthy one
    line: str = ""            # options of the line
    drops: tuple = ()         # the server ends the connection so often, and then takes none for so long; seconds
    refuses: bool = False     # it ends each connection at once
    profile: str = ""         # of both devices, in place of points
    port: object = None       # in place of a slave's
    events: tuple = ()        # (seconds between, bytes or function of the slave): what the line says by itself
    greeting: bytes = b""     # of a server
    points: tuple = ()        # in place of the slave's
    well: bool = False        # nothing is wrong, and nothing may be said
    family: str = "as first written"


def family(name, *faults):
    return [dataclasses.replace(fault, family=name) for fault in faults]
