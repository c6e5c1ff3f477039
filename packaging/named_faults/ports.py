# SPDX-License-Identifier: Apache-2.0
"""Ports at which no slave answers: each gives the text of `port:`."""

import os
import pty
import socket
import threading
import time
import tty



def CLOSE(exchange):
    """A manner: the server closes the connection in place of a reply."""
    return CLOSE


def missing(folder):
    return "/dev/serial/by-id/usb-nothing-if00"


def folder(folder):
    return folder


def refused(folder):
    server = socket.socket()
    server.bind(("127.0.0.1", 0))
    port = server.getsockname()[1]
    server.close()
    return f"tcp://127.0.0.1:{port}"


def no_name(folder):
    return "tcp://nobody.invalid:502"


def open_pty():
    master, slave = pty.openpty()
    tty.setraw(slave)
    _open.append(master)
    return slave


_open = []  # stay so to the end


def quiet_pty(folder):
    return os.ttyname(open_pty())


def garbage_pty(folder):
    slave = open_pty()
    master = _open[-1]

    def talk():
        while True:
            time.sleep(1)
            try:
                os.write(master, b"\xf3\x9e\x07\xe4\xf0\xc1\x86\x9a\xff\xe2\x0d")
            except OSError:
                return

    threading.Thread(target=talk, daemon=True).start()
    return os.ttyname(slave)
