#!/usr/bin/env python3
"""Compiles each source alone, by clang and without code: a source that uses a name which only its neighbours in a unity
batch declare is refused, and so is code that touches a member without the mutex that guards it (gateway/base/guarded.h).

usage: compile_alone.py BUILD/lint [--latest N] SOURCE…    BUILD/lint has compile_commands.json (compile_commands.py)

The sources that were changed last come first; --latest N: no more than so many.

The headers of the standard library that CMakeLists.txt precompiles (common_headers) are precompiled here as well.
SPDX-License-Identifier: Apache-2.0
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

FLAGS = ["-std=c++20", "-fPIC", "-Wall", "-Wthread-safety", "-Werror"]


def options(command):
    """Returns the definitions and include folders of a command of the build."""
    return re.findall(r"-D\S+|-I\S+|-isystem \S+", command)


def changed(root):
    """Returns all files of the history, the latest change first."""
    log = subprocess.run(["git", "log", "--format=", "--name-only"], cwd=root, capture_output=True, text=True, check=False)
    return list(dict.fromkeys(log.stdout.split()))


def main():
    folder, sources = pathlib.Path(sys.argv[1]), sys.argv[2:]
    most = len(sources)
    if sources[:1] == ["--latest"]:
        most, sources = int(sources[1]), sources[2:]
    root = pathlib.Path(__file__).resolve().parent.parent
    commands = {}
    for entry in json.loads((folder / "compile_commands.json").read_text(encoding="utf-8")):
        commands[os.path.relpath(entry["file"], root)] = options(entry["command"])
    # Definitions of one library only would make clang refuse the precompiled headers.
    common = set.intersection(*(set(o for o in c if o.startswith("-D")) for c in commands.values()))
    named = re.search(r"set\(common_headers ([^)]*)\)", (root / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    header = folder / "common_headers.hpp"
    header.write_text("".join(f"#include {name}\n" for name in named.split()), encoding="utf-8")
    precompiled = folder / "common_headers.pch"
    subprocess.run(["clang++", *FLAGS, *sorted(common), "-x", "c++-header", header, "-o", precompiled], check=True)

    age = {source: number for number, source in enumerate(changed(root))}

    def compile_one(source):
        words = [word for option in commands[source] for word in option.replace('\\"', '"').split(" ", 1)]
        return subprocess.run(["clang++", *FLAGS, "-fsyntax-only", *words, "-include-pch", precompiled, source],
                              cwd=root, capture_output=True, text=True, check=False)

    # A source that no target compiles (DDS or tests are left out of this build) cannot be compiled here either.
    known = sorted((source for source in sources if source in commands), key=lambda source: age.get(source, len(age)))[:most]
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for source, done in zip(known, pool.map(compile_one, known)):
            if done.returncode != 0:
                failed += 1
                print(f"{source} does not compile alone:\n{done.stderr}", file=sys.stderr)
    print(f"{len(known)} sources compiled alone, {failed} failed, of {len(sources)}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
