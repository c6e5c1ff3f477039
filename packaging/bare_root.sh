# Functions for scripts that need a bare Debian 12 (debootstrap), as root. Source this file after prepare.sh, with $base set
# to the root that is made once, and $root to the copy of it in which `inside` runs commands.

PATH=$PATH:/usr/sbin:/sbin

inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
quiet() { "$@" >"$root.log" 2>&1 || { tail -n 20 "$root.log" >&2; return 1; }; }
mirror() { apt-get indextargets --format '$(REPO_URI) $(CODENAME)' 2>/dev/null | awk '$2 == "bookworm" { print $1; exit }'; }

# programs_of ARCH: makes the kernel run programs of ARCH, by an emulator if this is not the machine's architecture.
programs_of() {
  [ "$1" != "$(dpkg --print-architecture)" ] || return 0
  install_packages qemu-user-static binfmt-support
  mountpoint -q /proc/sys/fs/binfmt_misc || mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
  update-binfmts --enable
}

# bare_root [ARCH]: makes a fresh copy, by default of the machine's architecture.
bare_root() {
  local of=${1:-$(dpkg --print-architecture)} from
  programs_of "$of"
  if [ ! -d "$base" ]; then
    say "making a bare Debian 12 ($of)"
    from=$(mirror)
    quiet debootstrap --variant=minbase --arch="$of" bookworm "$base.new" "${from:-http://deb.debian.org/debian}"
    cp -r /etc/apt/sources.list.d /etc/apt/apt.conf.d "$base.new/etc/apt/"
    cp /etc/apt/sources.list "$base.new/etc/apt/sources.list" 2>/dev/null || : >"$base.new/etc/apt/sources.list"
    cp -rL /etc/resolv.conf /etc/hosts /etc/ssl "$base.new/etc/"
    cp -r /usr/share/keyrings "$base.new/usr/share/"
    mv "$base.new" "$base"
  fi
  rm -rf --one-file-system "$root"
  cp -a "$base" "$root"
  trap leave_root EXIT
  mount -t proc proc "$root/proc"
  mount -t devtmpfs devtmpfs "$root/dev" 2>/dev/null || mount --bind /dev "$root/dev"
  mkdir -p "$root/dev/pts"
  mountpoint -q "$root/dev/pts" || mount --bind /dev/pts "$root/dev/pts"
  quiet inside apt-get -qq update
}
leave_root() { local part; for part in dev/pts dev proc; do umount -l "$root/$part" 2>/dev/null || true; done; }
