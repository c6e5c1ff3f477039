# Sourced by run.sh and boot.sh: Debian's kernel, unpacked below $work and not installed, as it is no
# business of this machine; its drivers for the machine that is made.
# SPDX-License-Identifier: Apache-2.0

kernel_of_debian() { apt-cache depends linux-image-amd64 2>/dev/null | awk '$1 == "Depends:" { print $2; exit }'; }

# Fetches the kernel and these packages; $release is the kernel's.
fetch() {  # PACKAGE…
  mkdir -p "$work/packages" "$work/unpacked"
  local kernel package
  kernel=$(kernel_of_debian)
  if [ -z "$kernel" ]; then
    as_root apt-get -qq update
    kernel=$(kernel_of_debian)
  fi
  for package in "$kernel" "$@"; do
    compgen -G "$work/packages/${package}_*.deb" >/dev/null && continue
    say "fetching $package"
    (cd "$work/packages" && apt-get -qq -o APT::Sandbox::User=root download "$package")
    dpkg-deb -x "$work/packages/${package}"_*.deb "$work/unpacked"
  done
  release=${kernel#linux-image-}
  depmod -b "$work/unpacked" "$release"
}

# Drivers and what they need, into a root that has usr/lib/modules.
copy_drivers() {  # ROOT DRIVER…
  local root=$1 driver file
  shift
  for driver; do
    modprobe -d "$work/unpacked" -S "$release" --show-depends "$driver" | awk '$1 == "insmod" { print $2 }'
  done | sort -u | while read -r file; do
    install -D "$file" "$root/usr/lib/modules/$release/${file##*/}"
  done
  cp "$work/unpacked/lib/modules/$release"/modules.{builtin,builtin.modinfo,order} "$root/usr/lib/modules/$release"
  depmod -b "$root" "$release"
}
