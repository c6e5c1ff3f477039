# Sourced by checks.sh in the virtual machine: PASS and FAIL, units and their journal, a client and a
# subscriber on the other end of a network of its own, twins.
# SPDX-License-Identifier: Apache-2.0

failed=0
patience=90  # seconds; an emulated machine on a busy host is slow, and what it took is shown

chapter() { printf '\n== %s\n' "$*"; }

check() {  # TEXT CONDITION…
  local text=$1
  shift
  if "$@"; then
    echo "PASS $text"
  else
    failed=$((failed + 1))
    echo "FAIL $text"
  fi
}

uptime_now() { cut -d ' ' -f 1 /proc/uptime; }
seconds() { awk "BEGIN { printf \"%.2f\", $2 - $1 }"; }  # FROM TO
at_most() { awk "BEGIN { exit !($1 <= $2) }"; }          # NUMBER LIMIT

# Tries COMMAND until it succeeds; $took says how long.
eventually() {  # SECONDS COMMAND…
  local limit=$1 begun
  shift
  begun=$(uptime_now)
  until "$@"; do
    took=$(seconds "$begun" "$(uptime_now)")
    at_most "$took" "$limit" || return 1
    sleep 0.1
  done
  took=$(seconds "$begun" "$(uptime_now)")
}

timed() {  # COMMAND…; $took says how long
  local begun
  begun=$(uptime_now)
  "$@"
  took=$(seconds "$begun" "$(uptime_now)")
}

property() { systemctl show --value -p "$2" "$1"; }  # UNIT NAME
not() { ! "$@"; }
active() { [ "$(systemctl is-active "$1")" = active ]; }
main_process() { property "$1" MainPID; }
another_process() { active "$1" && [ "$(main_process "$1")" != "$2" ]; }  # UNIT EARLIER
restarts() { property "$1" NRestarts; }

# What the units have said since the last time.
print_journal() {
  journalctl --quiet --cursor-file=/run/cursor -o short-monotonic --no-hostname -u 'baudgate*' | sed 's/^/  /'
}

# A plant beyond the gateway's network port.
make_network() {
  ip netns add plant
  ip link add gateway0 type veth peer name plant0 netns plant
  ip address add 10.9.0.1/24 dev gateway0
  ip link set gateway0 up
  ip -n plant address add 10.9.0.2/24 dev plant0
  ip -n plant link set plant0 up
  ip -n plant link set lo up
  ip -n plant route add default dev plant0
}
in_plant() { ip netns exec plant setpriv --reuid visitor --regid visitor --init-groups "$@"; }

# UNIT REGISTER [TYPE]: one value as mbpoll prints it, or its error.
modbus() {
  in_plant mbpoll -m tcp -p 502 -a "$1" -0 -r "$2" -c 1 -t "${3:-3:float}" -B -1 -q 10.9.0.1 2>&1 |
    awk -F '\t' '/^\[/ { sub(/^ +/, "", $2); print $2 } /failed/ { print }'
}
quality_is() { [ "$(modbus "$1" 20000 3)" = "$2" ]; }  # UNIT QUALITY
reads() { [ "$(modbus "$1" "$2")" = "$3" ]; }  # UNIT REGISTER VALUE

# The values that a new subscriber gets, as objects.
watch_once() { in_plant timeout 20 baudgate watch --interface 10.9.0.2 --once --json "$@" 2>/run/watch.errors; }
# Good values of both twins.
subscriber_gets_both() {  # OPTION…
  [ "$(watch_once "$@" | jq -r 'select(.quality == 192) | .device + "." + .point + "=" + (.value | tostring)' |
    grep -xE 'first.output_0=1.5|second.output_1=2.5' | sort -u | wc -l)" = 2 ]
}

# A Modbus client that reads five times a second, until the end of what is done meanwhile.
begin_reading() {
  in_plant stdbuf -oL mbpoll -m tcp -p 502 -a 1 -0 -r 0 -c 1 -t 3:float -B -l 200 -o 0.5 10.9.0.1 >/run/reads 2>&1 &
  reader=$!
}
end_reading() {  # "N good, M other"
  kill "$reader" 2>/dev/null
  wait "$reader" 2>/dev/null
  awk '/^\[0\]/ { if ($2 == "1.5") good++; else other++ } /failed|onnection/ { other++ }
    END { print good + 0 " good, " other + 0 " other" }' /run/reads
}

status() { baudgate status --json 2>/dev/null | jq -r "$1"; }
dds_is() { [ "$(status .dds.state)" = "$1" ]; }

start_twin() {  # NAME ADDRESS
  systemd-run --quiet --unit="twin-$1" baudgate simulate --profile icpdas-i-7024 --address "$2" --pty "/run/twins/$1"
  eventually $patience test -e "/run/twins/$1"
}
# A twin wants a request in one piece, and an emulated 8250 hands over single characters: read(2) on a
# tty with VTIME gathers what comes less than 0.1 s apart.
start_twins() {
  mkdir -p /run/twins
  start_twin first 1
  start_twin second 2
  start_twin third 3
  # As udev does for a serial adapter.
  chgrp dialout "$(readlink -f /run/twins/second)"
  chmod 660 "$(readlink -f /run/twins/second)"
  systemd-run --quiet --unit=cable socat OPEN:/dev/ttyS2,raw,echo=0,vmin=255,vtime=1 OPEN:/run/twins/first,raw,echo=0
  systemd-run --quiet --unit=usb-cable socat OPEN:/dev/ttyS3,raw,echo=0,vmin=255,vtime=1 OPEN:/run/twins/third,raw,echo=0
}

exposure() { systemd-analyze security --no-pager "$1" | sed -n 's/.*exposure level for .*: \([0-9.]*\) .*/\1/p'; }

# As the service: its mounts, and what its control group may open.
inside_service() { nsenter --mount --target "$(main_process baudgate)" -- "$@" 2>/dev/null; }
service_opens() {  # FILE
  sh -c 'echo $$ >/sys/fs/cgroup/system.slice/baudgate.service/cgroup.procs && exec 3<>"$1"' - "$1" 2>/dev/null
}
process_state() { awk -v key="$1:" '$1 == key { print $2 }' /proc/"$(main_process baudgate)"/status; }  # NAME

adapter() { for one in /sys/bus/usb/devices/1-[0-9]/authorized; do echo "$1" >"$one"; done; }  # 1: plugged in, 0: unplugged
journal_of() { journalctl -b -u baudgate -o json "$@" | jq -r .MESSAGE; }  # FIELD=VALUE…
