#!/usr/bin/env bash
# Tests the page in a browser, against a mock server or a running gateway, and takes pictures of every view.
# usage: packaging/web_test.sh [--url URL] [--device LINE.DEVICE] [--pictures FOLDER] [--axe axe.min.js] [--only WORD]
#   --url       the page of a running gateway; what needs the mock server is then left out
#   --pictures  where the pictures go (build/web_pictures)
#   --axe       the accessibility checker axe-core; fetched by npm into a folder that goes when it is not given
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

pictures=build/web_pictures axe='' url='' options=()
while [ $# -gt 0 ]; do
  case $1 in
    --pictures) pictures=$2 ;;
    --axe) axe=$2 ;;
    --url) url=$2; options+=(--url "$2") ;;
    --device | --only) options+=("$1" "$2") ;;
    *) sed -n '2,7s/^# \?//p' "$0" >&2; exit 2 ;;
  esac
  shift 2
done

packages=(python3 python3-selenium chromium chromium-driver libjs-dygraphs)
install_packages
work=$(mktemp -d)
mock=''
end() {
  [ -z "$mock" ] || kill "$mock"
  rm -rf "$work"
}
trap end EXIT
if [ -z "$axe" ] && command -v npm >/dev/null; then
  npm install --silent --no-audit --no-fund --prefix "$work" axe-core@4 >/dev/null && axe=$work/node_modules/axe-core/axe.min.js
fi
[ -n "$axe" ] || say "without npm and --axe accessibility is not checked"

say "testing the page"
# The interpreter of the system: selenium is a package of it.
/usr/bin/python3 packaging/web_test/test_page.py "${options[@]}" ${axe:+--axe "$axe"}

if [ -z "$url" ]; then
  /usr/bin/python3 packaging/web_test/mock.py --port 0 >"$work/url" &
  mock=$!
  while [ ! -s "$work/url" ]; do sleep 0.1; done
  url=$(cat "$work/url")
  say "pictures in $pictures"
  /usr/bin/python3 packaging/web_test/shots.py "$url" "$pictures"
fi
