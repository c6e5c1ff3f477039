#!/usr/bin/env bash
# Boots Debian 12 with systemd as PID 1 in a virtual machine, with what `cmake --install` puts there, and
# starts, polls, kills, stops and restarts the units as they are shipped. Software emulation, or with
# ACCEL=kvm faster; no network beyond the machine. As root, by hand or nightly, never in CI.
# docs/boot-test.md says what it shows.
# usage: tests/system/vm/boot.sh [BUILD]    the directory with the built baudgate, default build/release; or the one with
#                                           the packages, build/deb
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
cd "$(dirname "$0")/../../.."
. packaging/prepare.sh
. packaging/later.sh
. tests/system/vm/kernel.sh

PATH=$PATH:/usr/sbin:/sbin
readonly sources=tests/system/vm/boot
readonly time_limit=2400
packages=(qemu-system-x86 debootstrap busybox-static kmod cpio e2fsprogs)
readonly guest_packages=(systemd-sysv dbus libpam-systemd udev kmod iproute2 procps socat jq mbpoll)

made=${1:-build/release}
packaged=$(compgen -G "$made/baudgate_*.deb" || true)
if [ -z "$packaged" ] && [ ! -x "$made/baudgate-dds" ]; then
  echo "no $made/baudgate-dds; build it first: cmake --preset release && cmake --build --preset release" >&2
  exit 2
fi
if [ "$(id -u)" != 0 ]; then
  echo "debootstrap makes files of root: run as root" >&2
  exit 2
fi
made=$(realpath "$made")
work=$made/boot-test
root=$work/root

debs() { ls "$made"/baudgate{,-dds}_*.deb; }

# The package of this name, or one that provides it: debootstrap knows no virtual ones.
provider() {
  if [ -n "$(apt-cache show "$1" 2>/dev/null)" ]; then
    echo "$1"
  else
    apt-cache showpkg "$1" | awk '/^Reverse Provides/ { found = 1; next } found { print $1; exit }'
  fi
}

# Debian's packages with the libraries that the build links, or that ours depend on.
libraries() {
  if [ -n "$packaged" ]; then
    for deb in $(debs); do dpkg-deb -f "$deb" Depends; done | tr ',' '\n' | sed 's/[(|].*//; s/ //g' | grep -v '^baudgate' |
      sort -u | while read -r name; do provider "$name"; done
    return
  fi
  ldd "$made"/{baudgate,baudgate-dds} "$made"/protocols/*.so |
    awk '$2 == "=>" && $3 ~ /^\// { print $3 }' | sort -u |
    while read -r file; do dpkg -S "$file" 2>/dev/null || dpkg -S "$(realpath "$file")"; done | cut -d: -f1 | sort -u
}

make_base() {
  [ ! -e "$work/base/made" ] || return 0
  say "making a bare Debian 12: some minutes, once"
  rm -rf "$work/base"
  local mirror
  mirror=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME)' | awk '$2 == "bookworm" { print $1; exit }')
  debootstrap --variant=minbase --include="$({ printf '%s\n' "${guest_packages[@]}" && libraries; } | paste -sd,)" \
    bookworm "$work/base" "$mirror" >"$work/debootstrap.log" 2>&1 || { tail "$work/debootstrap.log" >&2; exit 4; }
  rm -rf "$work"/base/var/{cache/apt,lib/apt/lists}/*
  touch "$work/base/made"
}

# As README.md says: cmake --install, systemd-sysusers, a configuration, enable; or the packages.
install_into_root() {
  if [ -n "$packaged" ]; then
    install -d "$root/packages/later"
    for deb in $(debs); do
      cp "$deb" "$root/packages"
      later "$deb" "$root/packages/later/${deb##*/}"
    done
    chroot "$root" sh -c 'DEBIAN_FRONTEND=noninteractive dpkg -i /packages/*.deb' >"$work/dpkg.log" 2>&1 ||
      { tail "$work/dpkg.log" >&2; exit 4; }
  else
    DESTDIR=$root cmake --install "$made" --strip >/dev/null
    chroot "$root" systemd-sysusers
  fi
}

make_root() {
  say "installing into it"
  rm -rf "$root"
  cp -a "$work/base" "$root"
  install_into_root
  install -D -m 644 "$sources/baudgate.yaml" "$root/etc/baudgate/baudgate.yaml"
  chroot "$root" baudgate check >"$work/check.log" || { cat "$work/check.log" >&2; exit 2; }
  chroot "$root" systemctl --quiet enable baudgate
  chroot "$root" useradd --create-home --uid 1000 --groups baudgate visitor
  install -d "$root/test"
  cp "$sources"/{checks,tools,upgrade}.sh "$root/test"
  cp "$sources/boot-test.service" "$root/etc/systemd/system"
  chroot "$root" systemctl --quiet enable boot-test
  chroot "$root" systemctl --quiet mask serial-getty@ttyS0 getty@tty1 apt-daily.timer apt-daily-upgrade.timer
  echo boot >"$root/etc/hostname"
  echo "127.0.0.1 localhost boot" >"$root/etc/hosts"
  copy_drivers "$root" veth xhci_pci usbserial cdc_acm ftdi_sio
  rm -f "$work/disk"
  truncate -s 2G "$work/disk"
  mke2fs -q -t ext4 -d "$root" "$work/disk"
}

make_initramfs() {
  local start=$work/start
  rm -rf "$start"
  mkdir -p "$start"/{bin,dev,root,usr/lib/modules}
  ln -s usr/lib "$start/lib"
  cp /bin/busybox "$start/bin"
  install "$sources/init" "$start/init"
  copy_drivers "$start" virtio_pci virtio_blk crc32c_generic ext4
  (cd "$start" && find . | cpio --quiet -o -H newc | gzip -1) >"$work/initramfs"
}

# ttyS0 is the console, ttyS1 the gateway's port; a cable leads from it to ttyS2, where the twin is. Another leads from
# a USB adapter, which the kernel leaves alone until it is told of it (authorized), to ttyS3.
start_machine() {
  rm -f "$work/cable" "$work/usb"
  timeout "$time_limit" nice qemu-system-x86_64 -accel "${ACCEL:-tcg}" -cpu max -smp 2 -m 1024 -nodefaults -no-user-config \
    -display none -no-reboot -kernel "$work/unpacked/boot/vmlinuz-$release" -initrd "$work/initramfs" \
    -append "console=ttyS0 quiet loglevel=3 panic=-1 systemd.show_status=no usbcore.authorized_default=0 no_timer_check" \
    -drive "file=$work/disk,format=raw,if=virtio,cache=unsafe" \
    -chardev stdio,id=console,signal=off -serial chardev:console \
    -chardev "socket,id=near,path=$work/cable,server=on,wait=off" -serial chardev:near \
    -chardev "socket,id=far,path=$work/cable" -device pci-serial,chardev=far,addr=10 \
    -chardev "socket,id=adapter,path=$work/usb,server=on,wait=off" -device qemu-xhci,id=usb,addr=12 \
    -device usb-serial,chardev=adapter,bus=usb.0,serial=BG1 \
    -chardev "socket,id=behind,path=$work/usb" -device pci-serial,chardev=behind,addr=11 \
    </dev/null 2>"$work/qemu.log" | sed -u 's,\r$,,' | tee "$work/transcript"
}

install_packages
mkdir -p "$work"
fetch
make_base
make_root
make_initramfs
say "starting the machine ($(qemu-system-x86_64 --version | head -n 1), Linux $release)"
start_machine || true
cat "$work/qemu.log" >&2
say "transcript: $work/transcript"
grep -q '^== 0 failed$' "$work/transcript"
