#!/usr/bin/env bash
# Runs baudgate in a small virtual machine on real tty drivers: an FTDI adapter that is unplugged and
# plugged back while a device behind it is polled, and a port of the board (8250). Debian's kernel and
# udev inside, software emulation (no KVM), no network; the devices are twins on this side. By hand or
# nightly, never in CI: two minutes. docs/vm-test.md says what it shows.
# usage: tests/system/vm/run.sh [BUILD]    the directory with the built baudgate, default build/release
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
cd "$(dirname "$0")/../../.."
. packaging/prepare.sh
. tests/system/vm/kernel.sh

PATH=$PATH:/usr/sbin:/sbin
readonly sources=tests/system/vm
readonly time_limit=900
packages=(g++ qemu-system-x86 busybox-static cpio kmod socat mbpoll)

made=${1:-build/release}
if [ ! -x "$made/baudgate" ]; then
  echo "no $made/baudgate; build it first: cmake --preset release && cmake --build --preset release" >&2
  exit 2
fi
made=$(realpath "$made")
work=$made/vm-test
root=$work/root
children=()
trap 'kill "${children[@]}" 2>/dev/null || true' EXIT

copy_with_libraries() {  # PROGRAM… that are in $root already
  local library
  ldd "$@" | awk '$2 == "=>" && $3 ~ /^\// { print $3 } $1 ~ /^\// && $2 ~ /^\(/ { print $1 }' | sort -u |
    while read -r library; do cp -L --parents "$library" "$root"; done
}

make_initramfs() {
  say "making the initramfs"
  rm -rf "$root"
  mkdir -p "$root"/{dev,proc,sys,run,tmp,etc} "$root"/usr/{bin,sbin,lib,lib64}
  ln -s usr/bin usr/sbin usr/lib usr/lib64 "$root"
  busybox --list | while read -r name; do ln -s busybox "$root/bin/$name"; done
  cp --remove-destination /bin/busybox "$root/bin"
  install "$work/unpacked/bin/udevadm" "$(command -v mbpoll)" "$root/bin"
  g++ -std=c++20 -O1 -Wall -Wextra -Werror -o "$root/bin/port_facts" "$sources/port_facts.cpp"
  mkdir -p "$root/lib/udev/rules.d"
  (cd "$work/unpacked/lib/udev/rules.d" &&
    cp 50-udev-default.rules 60-serial.rules 80-drivers.rules "$root/lib/udev/rules.d")
  echo "root:x:0:0:root:/:/bin/sh" >"$root/etc/passwd"
  { echo root && grep -ohP 'GROUP="\K[a-z]+' "$root"/lib/udev/rules.d/*; } | sort -u |
    awk '{ print $1 ":x:" NR - 1 ":" }' >"$root/etc/group"
  mkdir -p "$root/opt/baudgate/protocols"
  cp "$made/baudgate" "$root/opt/baudgate"
  cp "$made"/protocols/*.so "$root/opt/baudgate/protocols"
  strip --strip-debug "$root/opt/baudgate/baudgate" "$root"/opt/baudgate/protocols/*.so
  cp -r config/profiles "$root/opt/baudgate"
  mkdir "$root/vm"
  cp -r "$sources"/{checks.sh,tools.sh,profiles} "$root/vm"
  install "$sources/init" "$root/init"
  copy_drivers "$root" xhci_pci ftdi_sio
  copy_with_libraries "$root/opt/baudgate/baudgate" "$root"/opt/baudgate/protocols/*.so \
    "$root"/bin/{udevadm,mbpoll,port_facts}
  (cd "$root" && find . | cpio --quiet -o -H newc | gzip -1) >"$work/initramfs"
}

start_twin() {  # NAME ADDRESS
  rm -f "$work/$1.pty"
  BAUDGATE_MODULES=$sources "$made/baudgate" simulate --profile "$1" --address "$2" --pty "$work/$1.pty" \
    >"$work/$1.log" 2>&1 &
  children+=($!)
  local tries=50
  until [ -e "$work/$1.pty" ]; do
    sleep 0.1
    ((tries-- > 0)) || { cat "$work/$1.log" >&2; exit 4; }
  done
}

# The emulated 8250 hands over single characters, and a twin wants a request in one piece: read(2) on a
# tty with VTIME gathers what comes less than 0.1 s apart.
lay_cable() {  # NAME
  socat "PTY,raw,echo=0,link=$work/$1.cable" "PTY,raw,echo=0,link=$work/$1.gather" &
  children+=($!)
  until [ -e "$work/$1.cable" ] && [ -e "$work/$1.gather" ]; do sleep 0.1; done
  socat "OPEN:$work/$1.gather,raw,echo=0,vmin=255,vtime=1" "OPEN:$work/$1.pty,raw,echo=0" &
  children+=($!)
}

start_machine() {
  rm -f "$work"/{control.in,control.out,monitor,adapter.trace}
  mkfifo "$work/control.in" "$work/control.out"
  exec {from_guest}<>"$work/control.out" {to_guest}<>"$work/control.in"
  # The adapter comes and goes by the monitor; its far end, the chardev, stays.
  timeout "$time_limit" nice qemu-system-x86_64 -accel tcg -m 512 -nodefaults -no-user-config -display none \
    -no-reboot -kernel "$work/unpacked/boot/vmlinuz-$release" -initrd "$work/initramfs" \
    -append "console=ttyS0 quiet loglevel=3 panic=-1" \
    -chardev stdio,id=console,signal=off -serial chardev:console \
    -chardev pipe,id=control,path="$work/control" -serial chardev:control \
    -chardev serial,id=module,path="$work/module.cable" -device pci-serial,chardev=module \
    -chardev serial,id=relay,path="$work/relay.pty" -device qemu-xhci,id=usb \
    -monitor unix:"$work/monitor",server,nowait \
    -D "$work/adapter.trace" -trace 'usb_serial_set_*' </dev/null > >(sed -u 's,\r$,,' | tee "$work/transcript") &
  machine=$!
  children+=("$machine")
}

# What the guest asks of this side, one command a line; the answer ends with a line ".".
serve_guest() {
  local command rest
  while kill -0 "$machine" 2>/dev/null; do
    read -r -t 1 -u "$from_guest" command rest || continue
    case $command in
      monitor) printf '%s\n' "$rest" | socat -t 0.2 - "UNIX-CONNECT:$work/monitor" | grep -a '^Error' || true ;;
      adapter) grep -a "usb_serial_set_$rest" "$work/adapter.trace" | tail -n 1 || true ;;
      result) result=$rest ;;
      *) echo "unknown command $command" ;;
    esac >&"$to_guest"
    echo . >&"$to_guest"
  done
}

install_packages
fetch udev
make_initramfs
start_twin relay 7
start_twin module 1
lay_cable module
say "starting the machine ($(qemu-system-x86_64 --version | head -n 1), Linux $release)"
result="no result"
start_machine
serve_guest
wait "$machine" || true
say "result: $result; transcript: $work/transcript"
[ "$result" = "0 failed" ]
