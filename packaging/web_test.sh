#!/usr/bin/env bash
# Tests the page in a browser and the metrics with Prometheus' own tool, and takes pictures of every view.
# usage: packaging/web_test.sh [PART…] [--only WORD] [--pictures FOLDER] [--axe axe.min.js]
#        packaging/web_test.sh --url URL [--device LINE.DEVICE]     the page of a running gateway, as far as one can look only
#   mock       the page before a server that answers from samples
#   gateway    the page of a gateway with twins, which are killed
#   metrics    promtool check metrics, test rules
#   hostile    a minute of floods, foreign hosts, path tricks, slow readers and half-open connections
#   pictures   into build/web_pictures, or the folder
#   quick      the most important tests of `gateway`, and no other part; .ci/run does this
# Without a part all of them but `quick`. --axe: the accessibility checker axe-core; without it npm fetches it into a folder that goes.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

pictures=build/web_pictures axe='' url='' options=() parts=()
while [ $# -gt 0 ]; do
  case $1 in
    mock | gateway | metrics | hostile | pictures | quick) parts+=("$1"); shift; continue ;;
    --pictures) pictures=$2 ;;
    --axe) axe=$2 ;;
    --url) url=$2; options+=(--url "$2") ;;
    --device | --only) options+=("$1" "$2") ;;
    *) sed -n '2,11s/^# \?//p' "$0" >&2; exit 2 ;;
  esac
  shift 2
done
[ ${#parts[@]} -gt 0 ] || parts=(mock gateway metrics hostile pictures)
wanted() { [[ " ${parts[*]} " = *" $1 "* ]]; }

packages+=(python3-selenium chromium chromium-driver prometheus)
install_packages
work=$(mktemp -d)
mock=''
end() {
  [ -z "$mock" ] || kill "$mock"
  rm -rf "$work"
}
trap end EXIT
if [ -z "$axe" ] && [ "${parts[*]}" != quick ] && command -v npm >/dev/null; then
  npm install --silent --no-audit --no-fund --prefix "$work" axe-core@4 >/dev/null && axe=$work/node_modules/axe-core/axe.min.js
fi
[ -n "$axe" ] || [ "${parts[*]}" = quick ] || say "without npm and --axe accessibility is not checked"

# Uses the interpreter of the system, because selenium is its package.
page() { /usr/bin/python3 packaging/web_test/test_page.py "$@" "${options[@]}" ${axe:+--axe "$axe"}; }
if [ -n "$url" ]; then
  page
  exit
fi
if wanted mock; then
  say "testing the page before samples"
  page
fi
if wanted gateway || wanted metrics || wanted hostile || wanted quick; then
  build_product baudgate
fi
if wanted gateway; then
  say "testing the page of a gateway with twins"
  page --gateway build/release/baudgate
fi
if wanted quick; then
  say "testing the page of a gateway with twins: what every visitor sees"
  page --gateway build/release/baudgate --quick
fi
if wanted metrics; then
  say "testing the metrics"
  /usr/bin/python3 packaging/web_test/metrics.py build/release/baudgate | promtool check metrics
  promtool test rules packaging/prometheus/baudgate.rules.test.yml
fi
if wanted hostile; then
  say "attacking a gateway for a minute"
  /usr/bin/python3 packaging/web_test/hostile.py build/release/baudgate
fi
if wanted pictures; then
  /usr/bin/python3 packaging/web_test/mock.py --port 0 --role engineer >"$work/url" &
  mock=$!
  while [ ! -s "$work/url" ]; do sleep 0.1; done
  say "pictures in $pictures"
  /usr/bin/python3 packaging/web_test/shots.py "$(cat "$work/url")" "$pictures"
fi
