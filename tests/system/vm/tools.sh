# Sourced by checks.sh in the virtual machine: the host's monitor, baudgate and its log, values by
# Modbus TCP, PASS and FAIL.
# SPDX-License-Identifier: Apache-2.0

failed=0
shown=0  # lines of the log that stand in the transcript
exec 3<>/dev/ttyS1
stty -F /dev/ttyS1 raw -echo

chapter() { printf '\n== %s\n' "$*"; }

check() {  # TEXT CONDITION…
  text=$1
  shift
  if "$@"; then
    echo "PASS $text"
  else
    failed=$((failed + 1))
    echo "FAIL $text"
  fi
}

now() { read -r up _ </proc/uptime && echo "$up"; }
seconds() { awk "BEGIN { printf \"%.2f\", $2 - $1 }"; }  # FROM TO
within() { awk "BEGIN { exit !($1 <= $2) }"; }           # SECONDS LIMIT

host() {
  echo "$*" >&3
  while read -r reply <&3 && [ "$reply" != . ]; do echo "$reply"; done
}

monitor() {
  echo "(qemu) $*"
  host monitor "$*"
}
plug() { monitor device_add usb-serial,id=adapter,bus=usb.0,chardev=relay,serial=BG1; }
unplug() { monitor device_del adapter; }

# Writes the time at which PATH appears to /run/NAME.
watch_for() {  # NAME PATH
  until [ -e "$2" ]; do usleep 2000; done
  now >"/run/$1"
}

write_configuration() {  # SERIAL [KEYS-OF-THE-USB-LINE]
  cat >/run/vm.yaml <<END
gateway: { name: vm }
modbus: { listen: "127.0.0.1:1502" }
dds: { enabled: false }
lines:
  - name: usb
    port: $by_id
    serial: $1
    protocol: spabus
    devices: [ { name: relay, address: 7, profile: relay, unit: 1, poll: 200ms } ]
  - name: board
    port: $board
    serial: 9600 8N1
    protocol: dcon
    timing: { reply: 1s }
    devices: [ { name: module, address: 1, profile: module, unit: 2, poll: 200ms } ]
END
}

# The log gets the machine's uptime before each line, to compare with the other times.
start_baudgate() {  # SERIAL
  write_configuration "$1"
  : >/run/log
  shown=0
  rm -f /run/log.pipe && mkfifo /run/log.pipe
  while IFS= read -r line; do
    read -r up _ </proc/uptime
    echo "$up $line"
  done </run/log.pipe >>/run/log &
  baudgate run -c /run/vm.yaml >/run/log.pipe 2>&1 &
  daemon=$!
}

stop_baudgate() {
  kill "$daemon"
  wait "$daemon"
}

print_log() {
  tail -n "+$((shown + 1))" /run/log | sed 's/^/  baudgate: /'
  shown=$(wc -l </run/log)
}
print_kernel() {
  dmesg -c | grep -E 'USB disconnect|new .* USB device|now (attached|disconnected)' | sed 's/^/  kernel: /'
}

log_time() { awk -v text="$1" 'index($0, text) { time = $1 } END { print time + 0 }' /run/log; }
log_count() { grep -c -F "$1" /run/log; }

# UNIT REGISTER [TYPE]: one value as mbpoll prints it, or its error.
modbus() {
  mbpoll -m tcp -p 1502 -a "$1" -0 -r "$2" -c 1 -t "${3:-3}" -B -1 -q 127.0.0.1 2>&1 |
    awk -F '\t' '/^\[/ { sub(/^ +/, "", $2); print $2 } /failed/ { print }'
}
quality() { modbus "$1" 20000; }

await_quality() {  # UNIT QUALITY SECONDS; the time goes to $reached
  deadline=$(awk -v limit="$3" '{ print $1 + limit }' /proc/uptime)
  until [ "$(quality "$1")" = "$2" ]; do
    reached=$(now)
    within "$reached" "$deadline" || return 1
  done
  reached=$(now)
}

status_of() {  # LINE KEY: a number of `baudgate status`
  baudgate status "$1" --json | tr ',{}' '\n' | sed -n "s/^ *\"$2\": *\([0-9]*\).*/\1/p" | head -n 1
}
status_words() {  # LINE KEY…
  name=$1
  shift
  for key; do printf '%s=%s ' "$key" "$(status_of "$name" "$key")"; done
}
fact() { port_facts "$1" | tr ' ' '\n' | sed -n "s/^$2=//p"; }  # PORT NAME
