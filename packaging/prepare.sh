# Functions for demo.sh, test.sh and similar scripts, which source this file: they install the packages for the build on Debian 12
# and build. They work as root and with sudo, never ask, and repeat nothing.

# For the product. ccache is used if it is installed, and not installed here: a first build is faster without it.
packages=(
  ca-certificates g++ cmake ninja-build pkg-config python3
  libfastrtps-dev libfastcdr-dev libasio-dev libmodbus-dev libyaml-cpp-dev libfmt-dev
  libcli11-dev nlohmann-json3-dev libsystemd-dev libssl-dev libsqlite3-dev zlib1g-dev
  libmicrohttpd-dev libgnutls28-dev libcrypt-dev libmosquitto-dev
  libcurl4-openssl-dev libsnappy-dev
)
# Only for tests: build_tests.
test_packages=(
  libgtest-dev libgmock-dev mbpoll socat stunnel4 openssl curl iproute2 cyclonedds-dev cyclonedds-tools
  # pymodbus only recommends the other two packages, but imports them.
  python3-pymodbus python3-serial python3-serial-asyncio
  # A broker.
  mosquitto
  # Receivers of remote write.
  prometheus victoria-metrics
  # The test of packaging/prose.py makes repositories.
  git
  # For the exposure of the units (systemd-analyze), and for tests of their filters of system calls without systemd.
  systemd libseccomp-dev
)
# Only for fuzzing: install_packages "${fuzz_packages[@]}".
fuzz_packages=(clang libclang-rt-14-dev)
# Only for packaging/lint.sh.
lint_packages=(clang clang-format-14 clang-tidy-14)

say() { printf '\n== %s\n' "$*"; }

as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    echo "packages are missing and neither root nor sudo is at hand: run as root:" >&2
    echo "  $*" >&2
    return 1
  fi
}

# install_packages [PACKAGE…]: installs the packages of every build, and these.
install_packages() {
  local missing=() package
  for package in "${packages[@]}" "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' ||
      missing+=("$package")
  done
  if [ ${#missing[@]} = 0 ]; then
    say "all packages are installed"
    return
  fi
  say "installing ${#missing[@]} packages: ${missing[*]}"
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends \
    "${missing[@]}" >/dev/null
}

# configure PRESET [OPTION OF CMAKE…]
configure() { cmake --preset "$@" >/dev/null; }

# Configures the release. Tests may need missing packages, so they are left out until build_tests, and stay from then on.
configure_product() {
  if [ -f build/release/CMakeCache.txt ]; then
    configure release
  else
    configure release -DBAUDGATE_TESTS=OFF
  fi
}

# build_product TARGET…: builds targets of the release, without tests.
build_product() {
  install_packages
  configure_product
  build release "$@"
}

# build_tests PRESET [TARGET…]
build_tests() {
  install_packages "${test_packages[@]}"
  configure "$1" -DBAUDGATE_TESTS=ON
  build "$@"
}

# build PRESET [TARGET…]: builds the configured preset, with as many jobs as there are processors.
build() {
  local preset=$1
  shift
  say "building ($preset): the first time takes some minutes"
  cmake --build --preset "$preset" -j "$(nproc)" ${1:+--target "$@"}
}

# fuzz_targets: prints the names in tests/fuzz/targets.txt.
fuzz_targets() { awk '!/^#/ && NF { print $1 }' tests/fuzz/targets.txt; }

# Builds the fuzz targets, unless $BAUDGATE_FUZZ_BUILD names a build that has them.
build_fuzz() {
  [ -z "${BAUDGATE_FUZZ_BUILD:-}" ] || return 0
  install_packages "${fuzz_packages[@]}"
  configure fuzz
  build fuzz
}

# fuzz OPTION…: runs every target in build/fuzz with these options of libFuzzer, two at a time, and
# prints a line for each. Fails if a target has a finding.
fuzz() {
  fuzz_targets | xargs -P 2 -I '{}' tests/fuzz/run.sh "${BAUDGATE_FUZZ_BUILD:-build/fuzz}" '{}' "$@"
}
