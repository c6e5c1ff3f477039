#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the metrics of a gateway with twins that has read its values and answered a Modbus client.

usage: metrics.py PROGRAM
"""

import socket
import sys
import time
import urllib.request

from stage import Gateway


def main():
    Gateway.program = sys.argv[1]
    gateway = Gateway()
    try:
        with socket.create_connection(("127.0.0.1", gateway.modbus)) as client:
            client.sendall(bytes.fromhex("000100000006010300000001"))
            client.recv(100)
        for _ in range(100):
            with urllib.request.urlopen(gateway.url + "/metrics") as answer:
                text = answer.read().decode()
            if text.count("baudgate_point_value{") > 20:
                break
            time.sleep(0.1)
        assert "baudgate_modbus_requests_total{" in text, text
        print(text, end="")
    finally:
        gateway.end()


if __name__ == "__main__":
    main()
