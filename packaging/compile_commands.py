#!/usr/bin/env python3
"""The compile commands of a build for clang: of each source alone, where CMake compiles several together
(Unity/unity_0_cxx.cxx includes them), and without the headers that g++ has precompiled.

usage: compile_commands.py BUILD/compile_commands.json    JSON goes to standard output
SPDX-License-Identifier: Apache-2.0
"""
import json
import re
import sys


def sources(file):
    if "/Unity/unity_" not in file:
        return [file]
    with open(file, encoding="utf-8") as unity:
        return re.findall(r'^#include "(.*)"', unity.read(), re.MULTILINE)


def main():
    with open(sys.argv[1], encoding="utf-8") as build:
        entries = json.load(build)
    apart = []
    for entry in entries:
        command = re.sub(r"-Winvalid-pch -include \S*cmake_pch\.hxx", "", entry["command"])
        for source in sources(entry["file"]):
            apart.append({"directory": entry["directory"], "file": source, "command": command.replace(entry["file"], source)})
    json.dump(apart, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
