#!/usr/bin/env python3
"""Runs the commands of README.md, in their order, and compares their output with the text of README.md.

usage: readme_test.py demo BINARY    the section "See it work", on the demo of this binary
       readme_test.py installed ROOT    all sections after it, in a bare Debian below ROOT in which the packages are installed

Every command of README.md must have a row in COMMANDS below, and every row must have its command. A row that is not run
here names the test that runs the command instead.
SPDX-License-Identifier: Apache-2.0
"""
import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import time

README = pathlib.Path(__file__).resolve().parent.parent / "README.md"
PATIENCE = 60  # seconds until a command must have printed the expected output


def commands(text):
    """Returns the commands of the code blocks, without their comments. A here-document is one command with its lines."""
    found, fence, here = [], False, None
    for line in text.split("\n"):
        if here is not None:
            here.append(line)
            if line == "EOF":
                found.append("\n".join(here))
                here = None
        elif line.startswith("```"):
            fence = not fence
        elif fence or line.startswith("    "):
            command = re.sub(r"\s+# .*", "", line).strip()
            if command.endswith("<<'EOF'"):
                here = [command]
            elif command:
                found.append(command)
    return found


def numbers(output):
    """Returns the values in the output of mbpoll: {register: value}."""
    return {int(r): float(v) for r, v in re.findall(r"^\[(\d+)\]:\s+(\S+)$", output, re.MULTILINE)}


def currents(count):
    def look(output):
        read = numbers(output)
        # A twin of a relay carries some current; the three phases and the neutral take two registers each.
        return list(read) == list(range(0, 2 * count, 2)) and all(0 <= v < 100 for v in read.values()) and read[0] > 0
    return look


def qualities(output):
    read = numbers(output)
    return len(read) == 6 and set(read.values()) == {192}


def words(*wanted):
    return lambda output: all(word in output for word in wanted)


BY_TEST = "packaging/test.sh"
BY_PACKAGES = "packaging/deb_test.sh"
BY_BOOT = "tests/system/vm/boot.sh"
# (beginning of the command, where it runs, what its output must show). `stays` marks a program that runs on.
COMMANDS = [
    ("packaging/demo.sh", "demo", words("web page http://127.0.0.1:8502/"), "stays"),
    ("packaging/test.sh", BY_TEST, None),
    ("sudo apt install mbpoll", BY_PACKAGES, None),
    ("mbpoll -m tcp -p 1502 -a 1 -0 -r 0 -c 4", "demo", currents(4)),
    ("build/release/baudgate watch --device spaj140c", "demo", words("spaj140c", "current_l1")),
    ("packaging/deb.sh", BY_PACKAGES, None),
    ("sudo apt install ./build/deb/", BY_PACKAGES, None),
    ("sudo adduser $USER dialout", BY_BOOT, None),
    ("baudgate simulate --profile spaj140c", "installed", words("/tmp/relay"), "stays"),
    ("sudo systemctl stop baudgate", BY_BOOT, None),
    ("baudgate ports", "installed", words("")),
    ("baudgate scan /tmp/relay --quick", "installed", words("spaj140c")),
    ("cat > first.yaml", "installed", words("")),
    ("baudgate check -c first.yaml", "installed", words("bay-1")),
    ("baudgate run -c first.yaml", "installed", words("1502"), "stays"),
    ("baudgate status", "installed", words("feeder-1")),
    ("baudgate map -c first.yaml", "installed", words("feeder-1", "current_l1", "20000")),
    ("mbpoll -m tcp -p 1502 -a 1 -0 -r 0 -c 3", "installed", currents(3)),
    ("mbpoll -m tcp -p 1502 -a 1 -0 -r 20000 -c 6", "installed", qualities),
    ("baudgate watch --device feeder-1 --once", "installed", words("feeder-1", "current_l1")),
    ("sudo install -m 640 -g baudgate first.yaml", "installed", words("")),
    ("sudo baudgate check && sudo systemctl restart", BY_BOOT, None),
    ("journalctl -u baudgate", BY_BOOT, None),
]


def row_of(command):
    # Chooses the longest beginning, because "baudgate check" begins two rows.
    rows = [row for row in COMMANDS if command.startswith(row[0])]
    return max(rows, key=lambda row: len(row[0]), default=None)


class Run:
    """A running command. Its output goes to a file, so that a command that runs on cannot block."""

    def __init__(self, command, prefix, folder):
        self.log = open(folder / "output", "w+b")
        self.process = subprocess.Popen(prefix + ["sh", "-c", command], stdout=self.log, stderr=subprocess.STDOUT,
                                        stdin=subprocess.DEVNULL, start_new_session=True)

    def output(self):
        return os.pread(self.log.fileno(), 1 << 20, 0).decode(errors="replace")

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)


def shows(run, look, stays, until):
    """Returns True as soon as the output is as expected and the program has ended, or runs on if it stays."""
    while time.monotonic() < until:
        code = run.process.poll()
        if look(run.output()) and (code == 0 or (stays and code is None)):
            return True
        if code is not None:
            return False
        time.sleep(0.2)
    return False


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("demo", "installed"):
        sys.exit(__doc__)
    place, subject = sys.argv[1:]
    found = commands(README.read_text(encoding="utf-8"))
    missing = [row[0] for row in COMMANDS if not any(row_of(command) is row for command in found)]
    strangers = [command for command in found if row_of(command) is None]
    for command in strangers:
        print(f"FAIL README.md has a command without a row in readme_test.py: {command}")
    for beginning in missing:
        print(f"FAIL README.md has no command for the row '{beginning}'")
    failed = len(strangers) + len(missing)

    here = pathlib.Path("build/readme")
    here.mkdir(parents=True, exist_ok=True)
    prefix = []
    if place == "installed":
        prefix = ["chroot", subject, "env", "-i", "--chdir=/root", "HOME=/root", "USER=root", "TERM=dumb",
                  "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]
    running = []
    try:
        for command in found:
            row = row_of(command)
            if row is None or row[1] not in ("demo", "installed"):
                if row is not None and place == "installed":
                    print(f"LEFT to {row[1]}: {command}")
                continue
            if row[1] != place:
                continue
            runs = command.replace("sudo ", "")
            if place == "demo":
                runs = runs.replace("packaging/demo.sh", f"exec {shlex.quote(subject)} demo")
                runs = runs.replace("build/release/baudgate", shlex.quote(subject))
            stays = len(row) > 3
            folder = here / str(len(running)) if stays else here
            folder.mkdir(exist_ok=True)
            until = time.monotonic() + PATIENCE
            # A gateway needs time for its first readings, so the command is repeated.
            while True:
                run = Run(runs, prefix, folder)
                good = shows(run, row[2], stays or "watch" in runs, until)
                if good or time.monotonic() > until - 1:
                    break
                run.end()
                time.sleep(1)
            first = command.split("\n", 1)[0]
            print(f"PASS {first}" if good else f"FAIL {first}\n{run.output()[-2000:]}")
            failed += 0 if good else 1
            if stays:
                running.append(run)
            else:
                run.end()
    finally:
        for run in reversed(running):
            run.end()
    print(f"== README.md, {place}: {failed} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
