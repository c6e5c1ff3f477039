#!/usr/bin/env bash
# Called by `packaging/deb.sh --test [ARCH | quick]`, as root: tries the packages in a bare Debian 12 (debootstrap). Installs
# them, runs the service's own command and the commands of README.md. Then, unless `quick`: upgrades with and without an edited
# configuration, removes and purges, compares what is left with what was there before, installs from a signed repository
# (packaging/repo.sh), and runs the tests of packaging/debian/tests. There is no systemd in the bare Debian: units are not started.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh
. packaging/later.sh

readonly arch=$1 out=$2 extent=${3:-all}
readonly base=build/deb-root-$arch.base root=build/deb-root-$arch
. packaging/bare_root.sh
readonly config=/etc/baudgate/baudgate.yaml
packages=(debootstrap dpkg-dev)
failed=0

apt_install() { quiet inside apt-get install -y -qq --no-install-recommends -o Dpkg::Options::=--force-confold "$@"; }
apt_purge() { quiet inside apt-get purge -y -qq "$@"; }

# check SENTENCE COMMAND…
check() {
  local sentence=$1
  shift
  if "$@" >"$root.log" 2>&1; then
    echo "PASS $sentence"
  else
    echo "FAIL $sentence: $(tail -n 3 "$root.log")"
    failed=$((failed + 1))
  fi
}
# check_each COMMAND…: runs a command that prints a line for each of its own checks.
check_each() { "$@" || failed=$((failed + 1)); }
end() {
  printf '\n== %s failed\n' "$failed"
  [ $failed = 0 ]
}
finish_if_quick() {
  [ "$extent" = quick ] || return 0
  end
  exit
}
says() { [ "$("${@:2}")" = "$1" ]; }
absent() { local path; for path in "$@"; do [ ! -e "$root$path" ] || { echo "$path is there"; return 1; }; done; }
not() { ! "$@"; }

# sbom_is_right DEB PACKAGE: compares the hashes in the SBOM of a package with its programs.
sbom_is_right() {
  rm -rf "$root.tree"
  dpkg-deb -x "$root$1" "$root.tree"
  python3 packaging/sbom.py --verify "$root.tree/usr/share/doc/$2/$2.spdx.json" "$root.tree"
}

# Lists all files except those that running programs write.
files() {
  (cd "$root" && find . -path ./proc -prune -o -path ./dev -prune -o -path ./tmp -prune -o -path ./packages -prune -o \
    -path ./var/cache -prune -o -path ./var/log -prune -o -path ./var/lib/apt -prune -o -path ./var/lib/dpkg -prune -o \
    -printf '%p %y %m %u:%g\n') | sort
}

# Starts the service as its unit does, without systemd; then checks its listening ports.
service_runs() {
  inside install -d -o baudgate -g baudgate /run/baudgate /var/lib/baudgate
  inside setpriv --reuid baudgate --regid baudgate --init-groups env STATE_DIRECTORY=/var/lib/baudgate \
    RUNTIME_DIRECTORY=/run/baudgate sh -c 'baudgate run & for i in $(seq 40); do
      mbpoll -m tcp -p 1502 -a 0 -0 -r 9000 -c 1 -t 3 -1 127.0.0.1 && break; sleep 0.5; done; code=$?
      grep -h " 0A " /proc/net/tcp | grep -q " 0100007F:05DE " || code=9
      kill $!; wait $!; exit $code'
}

install_packages
bare_root "$arch"
mkdir "$root/packages"
cp "$out"/baudgate*.deb "$root/packages/"
rm -f "$root"/packages/*-dbgsym_*.deb
gateway=/packages/$(cd "$root/packages" && echo baudgate_*.deb)
dds=/packages/$(cd "$root/packages" && echo baudgate-dds_*.deb)
dev=/packages/$(cd "$root/packages" && echo baudgate-dev_*.deb)
later "$root$gateway" "$root/packages/later.deb"

say "baudgate alone"
check "installs" apt_install ".$gateway"
check "without Fast DDS" not inside dpkg-query -W 'libfastrtps*'
check "its configuration is for the service only" says "640 root:baudgate" inside stat -c '%a %U:%G' $config
check "its configuration is good" inside baudgate check
check "the SBOM has the hash of each program" sbom_is_right "$gateway" baudgate
check "that of baudgate-dds as well" sbom_is_right "$dds" baudgate-dds
check "the VEX document is plain text" grep -q openvex "$root/usr/share/doc/baudgate/docs/vex.json"
check "man pages" inside sh -c 'ls /usr/share/man/man1/baudgate.1.gz /usr/share/man/man5/baudgate.yaml.5.gz'
check "its unit is enabled" inside test -L /etc/systemd/system/multi-user.target.wants/baudgate.service
check "names of serial adapters" inside test -e /lib/udev/rules.d/70-baudgate.rules
check "ports, also where there is none" quiet inside baudgate ports
check "that of the discovery server is not" absent /etc/systemd/system/multi-user.target.wants/baudgate-discovery.service
check "nor is its socket, which is there" sh -c "test -e $root/lib/systemd/system/baudgate.socket && ! test -e $root/etc/systemd/system/sockets.target.wants/baudgate.socket"
apt_install mbpoll
check "the service's command listens on loopback" service_runs

say "README.md"
apt_install ".$dds"
check_each packaging/readme_test.py installed "$root"
finish_if_quick

say "upgrades"
apt_purge baudgate-dds baudgate
apt_install ".$gateway"
check "upgrade with the configuration as it came" apt_install ./packages/later.deb
check "brings the new one" inside grep -q 'of the later version' $config
check "for the service only" says "640 root:baudgate" inside stat -c '%a %U:%G' $config
apt_purge baudgate
apt_install ".$gateway"
inside sh -c "echo '# edited' >>$config; install -d -o baudgate /var/lib/baudgate/x; echo kept >/var/lib/baudgate/x/state"
check "upgrade with an edited configuration" apt_install ./packages/later.deb
check "keeps it" says '# edited' inside tail -n 1 $config
check "for the service only" says "640 root:baudgate" inside stat -c '%a %U:%G' $config
check "keeps the state" says kept inside cat /var/lib/baudgate/x/state
check "remove" quiet inside apt-get remove -y -qq baudgate
check "takes the programs" absent /usr/bin/baudgate /lib/systemd/system/baudgate.service /usr/share/baudgate
check "and leaves configuration and state" says kept inside sh -c "grep -q edited $config && cat /var/lib/baudgate/x/state"
check "install again" apt_install ".$gateway"
check "takes the edited configuration up" inside grep -q edited $config
apt_purge baudgate

say "all three"
cp packaging/debian/tests/* "$root/tmp/"
quiet inside apt-get satisfy -y -qq --no-install-recommends \
  "$(for each in "$gateway" "$dds" "$dev"; do dpkg-deb -f "$root$each" Depends; done | sed 's/baudgate (=[^)]*), //' | paste -sd,)"
apt_install cmake g++ make cyclonedds-dev cyclonedds-tools fastddsgen libfastrtps-dev
files >"$root.before"
check "install" apt_install ".$gateway" ".$dds" ".$dev"
check "watch" inside baudgate watch --help
check "the example of a protocol builds and is loaded" inside sh /tmp/protocol
check "the examples for DDS build, read and write" inside sh /tmp/dds
check "baudgate-dds goes, the gateway stays" quiet inside apt-get purge -y -qq baudgate-dds
check "its configuration is still good" inside baudgate check
inside install -d -o baudgate /var/lib/baudgate/recordings
check "purge" apt_purge baudgate baudgate-dev
files >"$root.after"
check "leaves nothing" diff "$root.before" "$root.after"
check "but its two locked users" says '! !' inside sh -c 'grep -E "^baudgate(-dds)?:" /etc/shadow | cut -d: -f2 | cut -c1 | paste -sd" "'

say "from a signed repository"
install_packages reprepro gnupg
export GNUPGHOME=$PWD/$root.keys
rm -rf "$GNUPGHOME" "$root.repository"
mkdir -m 700 "$GNUPGHOME"
quiet gpg --batch --passphrase '' --quick-generate-key 'throw-away key of a test'
check "repo.sh makes it" packaging/repo.sh "$root.repository" 'throw-away key' "$root$gateway" "$root$dds" "$root$dev"
check "and adds to it" packaging/repo.sh "$root.repository" 'throw-away key' "$root/packages/later.deb"
quiet gpgconf --kill all
cp -r "$root.repository" "$root/repository"
mkdir -p "$root/etc/apt/keyrings"
cp "$root.repository/baudgate.gpg" "$root/etc/apt/keyrings/"
echo "deb [signed-by=/etc/apt/keyrings/baudgate.gpg] file:/repository bookworm main" >"$root/etc/apt/sources.list.d/baudgate.list"
check "apt trusts it" inside apt-get -qq update --error-on=any
check "apt installs from it" apt_install baudgate
check "the newest version" says "$(dpkg-deb -f "$root/packages/later.deb" Version)" inside dpkg-query -W -f '${Version}' baudgate
sed -i 's/^Description: .*/& changed/' "$root"/repository/dists/bookworm/InRelease
check "apt refuses a changed one" not inside apt-get -qq update --error-on=any

say "their own tests, by Debian's runner (autopkgtest)"
if [ "$arch" = "$(dpkg --print-architecture)" ]; then
  install_packages autopkgtest
  leave_root
  bare_root
  check "a twin is read over Modbus and DDS; a protocol builds against what is installed" \
    autopkgtest --no-built-binaries "$out"/baudgate_*.deb "$out"/baudgate-dds_*.deb "$out"/baudgate-dev_*.deb "$out/src" -- chroot "$root"
else
  echo "LEFT OUT: the emulator lacks what a twin asks of ptys"
fi
end
