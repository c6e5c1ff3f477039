# Sourced by demo.sh and test.sh: installs what the build needs on Debian 12 and builds the release.
# Works as root and with sudo, never asks, and does nothing that is already done.

packages=(
  ca-certificates g++ cmake ninja-build ccache pkg-config
  libfastrtps-dev libfastcdr-dev libasio-dev libmodbus-dev libyaml-cpp-dev libspdlog-dev libfmt-dev
  libcli11-dev nlohmann-json3-dev libsystemd-dev libssl-dev
  libgtest-dev libgmock-dev libbenchmark-dev mbpoll cyclonedds-dev cyclonedds-tools
)

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

install_packages() {
  local missing=() package
  for package in "${packages[@]}"; do
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

# build PRESET [TARGET…]: configures and builds with as many jobs as there are processors.
build() {
  local preset=$1
  shift
  say "building ($preset): the first time takes some minutes"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" -j "$(nproc)" ${1:+--target "$@"}
}
