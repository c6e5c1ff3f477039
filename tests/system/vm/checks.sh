# Runs in the virtual machine; each check is a line PASS or FAIL. Times are seconds of the emulated
# machine and shown as observed; the limits leave room for an emulation on a busy host.
# SPDX-License-Identifier: Apache-2.0

by_id=/dev/serial/by-id/usb-QEMU_QEMU_USB_SERIAL_BG1-if00-port0
board=/dev/ttyS2
good=192
not_connected=8
limit=5
. /vm/tools.sh

# Plugs in and waits until the value is good; prints when what happened.
plug_and_serve() {  # TTY
  rm -f /run/appeared /run/linked
  downs=$(log_count 'line usb: down')
  watch_for appeared "$1" &
  watch_for linked "$by_id" &
  plug &
  await_quality 1 $good 30
  wait $!
  print_kernel
  print_log
  appeared=$(cat /run/appeared)
  took=$(seconds "$appeared" "$reached")
  linked=$(cat /run/linked)
  echo "  observed: tty at $appeared, link by id at $linked, good value read at $reached," \
    "$(seconds "$linked" "$reached") s after the link"
  check "the value is good over Modbus TCP" [ "$(quality 1)" = $good ]
  check "and it is the twin's: 1.25" [ "$(modbus 1 0 3:float)" = 1.25 ]
  check "served $took s after the tty appeared (aim 1.5, limit $limit)" within "$took" $limit
  check "the log told of no other trouble meanwhile" [ "$(log_count 'line usb: down')" = "$downs" ]
}

# Its log folds equal lines of one minute: a new one tells of the next loss again.
restart_baudgate() {
  stop_baudgate
  start_baudgate "9600 7E1"
  check "served by a new daemon" await_quality 1 $good 30
  print_log
}

unplug_and_close() {
  before=$(log_count 'line usb: down')
  pulled=$(now)
  unplug
  await_quality 1 $not_connected 30
  sleep 3
  print_kernel
  print_log
  took=$(seconds "$pulled" "$(log_time 'line usb: down')")
  check "the line closed $took s after the monitor was asked to unplug (limit 2)" within "$took" 2
  check "one line in the log says why" [ $(($(log_count 'line usb: down') - before)) = 1 ]
  check "quality is $not_connected, not connected" [ "$(quality 1)" = $not_connected ]
  check "reading the value is an exception: $(modbus 1 0 3:float)" [ "$(modbus 1 0 3:float)" != 1.25 ]
  check "the other line goes on" [ "$(quality 2)" = $good ]
}

renumbering() {
  restart_baudgate
  exec 4</dev/ttyUSB0
  unplug_and_close
  plug_and_serve /dev/ttyUSB1
  check "the link by id leads to ttyUSB1 now" [ "$(readlink -f $by_id)" = /dev/ttyUSB1 ]
  exec 4<&-
}

serial_settings() {  # SERIAL STTY-WORDS… ; the last argument is what the adapter says
  serial=$1
  start_baudgate "$serial"
  check "$serial: served" await_quality 1 $good 30
  print_log
  modes=" $(stty -a -F "$(readlink -f $by_id)" 2>/dev/null | tr '\n;' '  ') "
  shift
  while [ $# -gt 1 ]; do
    check "$serial: stty says $1" [ "${modes#* "$1" }" != "$modes" ]
    shift
  done
  said=$(host adapter data)
  echo "  adapter: $(host adapter baud) / $said"
  check "$serial: the adapter got $1" [ "${said%"$1"}" != "$said" ]
  stop_baudgate
}

send_breaks() {  # CHARDEV
  for _ in 1 2 3 4 5; do
    monitor chardev-send-break "$1"
    sleep 0.7
  done
}

# What comes through the tty when nobody but a plain reader listens: first the twin's answer to a
# request, which shows that the reader works, then the break.
raw_break() {  # PORT CHARDEV REQUEST
  stty -F "$1" raw -echo 9600 inpck parmrk -ignbrk -brkint clocal
  before=$(fact "$1" brk)
  : >/run/raw
  cat "$1" >>/run/raw &
  reader=$!
  sleep 1
  printf '%s\r' "$3" >"$1"
  sleep 1
  answer=$(tr '\r\n' '  ' </run/raw)
  check "a plain reader hears the twin" [ -n "$answer" ]
  : >/run/raw
  monitor chardev-send-break "$2"
  sleep 1
  kill $reader
  echo "  observed: a plain reader with PARMRK got '$answer' for the request '$3'," \
    "then '$(xxd -p /run/raw)' for the break; the driver counted $(($(fact "$1" brk) - before)) breaks"
}

break_while_polling() {  # LINE UNIT PORT CHARDEV
  breaks=$(fact "$3" brk)
  counted=$(status_of "$1" framing_errors)
  exchanges=$(status_of "$1" exchanges)
  send_breaks "$4"
  sleep 2
  print_log
  breaks=$(($(fact "$3" brk) - breaks))
  counted=$(($(status_of "$1" framing_errors) - counted))
  exchanges=$(($(status_of "$1" exchanges) - exchanges))
  echo "  observed: 5 breaks sent, $breaks counted by the driver, $counted by baudgate, $exchanges exchanges meanwhile"
  echo "  baudgate status $1: $(status_words "$1" framing_errors corrupt partial no_reply stray_bytes)"
  check "baudgate counts the breaks that the driver reports" [ "$counted" = "$breaks" ]
  check "polling goes on" [ "$exchanges" -ge 5 ]
  check "the value is good again" await_quality "$2" $good 10
}

dmesg -c >/dev/null
chapter "1 The port is absent when baudgate starts"
start_baudgate "9600 7E1"
check "the other line is served" await_quality 2 $good 30
print_log
check "the log says that the port is missing" [ "$(log_count "no such port $by_id")" = 1 ]
check "quality is $not_connected, not connected" [ "$(quality 1)" = $not_connected ]
plug_and_serve /dev/ttyUSB0

chapter "2a Unplugged while it polls, and plugged back"
unplug_and_close
plug_and_serve /dev/ttyUSB0

chapter "2b The same while another program holds the old tty open: the number changes"
renumbering

chapter "2c And back again"
restart_baudgate
unplug_and_close
plug_and_serve /dev/ttyUSB0

chapter "3 Settings are accepted, read back, and reach the adapter"
stop_baudgate
serial_settings "9600 7E1" "speed 9600 baud" cs7 parenb -parodd -cstopb "parity E, data bits 7, stop bits 1"
serial_settings "19200 8O1" "speed 19200 baud" cs8 parenb parodd -cstopb "parity O, data bits 8, stop bits 1"
serial_settings "9600 8N2" "speed 9600 baud" cs8 -parenb cstopb "parity N, data bits 8, stop bits 2"

chapter "4a A break on the USB adapter"
raw_break "$(readlink -f $by_id)" relay ">7RI1:XX"
start_baudgate "9600 7E1"
await_quality 1 $good 30
print_log
break_while_polling usb 1 "$(readlink -f $by_id)" relay

chapter "4b A break on the port of the board"
break_while_polling board 2 $board module
check "breaks were seen here" [ "$breaks" -ge 1 ]
stop_baudgate
raw_break $board module "#01"

chapter "5 What the drivers can do"
tty=$(readlink -f $by_id)
latency=/sys/bus/usb-serial/devices/${tty#/dev/}/latency_timer
start_baudgate "9600 7E1"
check "low latency, the default: served" await_quality 1 $good 30
check "the latency timer of the adapter is 1 ms" [ "$(cat "$latency")" = 1 ]
port_facts "$tty" | sed "s|^|  $tty: |"
check "the port of the board is served" await_quality 2 $good 30
port_facts $board | sed "s|^|  $board: |"
stop_baudgate
start_baudgate "{ baud: 9600, data: 7, parity: even, low_latency: false }"
check "low_latency: false: served" await_quality 1 $good 30
check "the flag is off" [ "$(fact "$tty" low_latency)" = 0 ]
echo "  observed: the adapter's own latency timer is $(cat "$latency") ms"
stop_baudgate
start_baudgate "{ baud: 9600, data: 7, parity: even, rs485: { enabled: true } }"
await_quality 2 $good 30
print_log
check "rs485: refused, and the log says why" [ "$(log_count "has no RS-485 mode")" = 1 ]
check "and the line is down" [ "$(quality 1)" = $not_connected ]
stop_baudgate

# What a client asks of a port by RFC 2217: option COM-PORT, then each ARGUMENT as one subnegotiation.
com_port() {  # OCTAL-ESCAPES…
  printf '\377\373\054'
  for words; do printf '\377\372\054'"$words"'\377\360'; done
}

# Lends LINE to a client that asks for ARGUMENTS, and keeps the client until `kill $client`.
lend() {  # LINE ARGUMENTS…
  check "$1 is offered" baudgate release "$1" --tcp 127.0.0.1:4002 --rfc2217 --for 2min
  shift
  (com_port "$@"; sleep 60) | nc 127.0.0.1 4002 >/run/answers &
  client=$!
}
answered() { xxd -p /run/answers | tr -d '\n' | grep -q "fffa2c$1fff0"; }
eventually() {  # CONDITION…
  for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
    "$@" && return
    sleep 1
  done
  return 1
}
adapter_has() { case "$(host adapter data)" in *"$1") ;; *) return 1 ;; esac; }
port_has() { (echo; stty -a -F "$1" 2>/dev/null) | tr '\n;' '  ' | grep -q -- " $2 "; }  # PORT WORD
lent() { [ "$(quality 1)" != $good ]; }

chapter "6 The ports over the network (RFC 2217)"
start_baudgate "9600 7E1"
check "served" await_quality 1 $good 30
await_quality 2 $good 30
lend usb '\001\000\000\113\000' '\002\010' '\003\002' '\004\001' '\005\005' '\005\006' '\005\011'
check "the adapter got 8 data bits and odd parity" eventually adapter_has "parity O, data bits 8, stop bits 1"
echo "  adapter: $(host adapter baud)"
check "stty says 19200" eventually port_has "$tty" "speed 19200 baud"
check "the bit rate is confirmed" eventually answered 6500004b00
check "so is the parity" eventually answered 6702
check "and break on, break off, DTR off" eventually answered 6909
check "the values are out of service" lent
check "the other line goes on" [ "$(quality 2)" = $good ]
kill $client
pkill nc
check "the client leaves: the adapter has 7E1 again" eventually adapter_has "parity E, data bits 7, stop bits 1"
check "and the value is good" await_quality 1 $good 30
baudgate release usb --end
lend board '\003\004'
check "mark parity at the 16550A: stty says cmspar" eventually port_has $board cmspar
check "and it is confirmed" eventually answered 6704
kill $client
pkill nc
check "the board's port has no parity again" eventually port_has $board -parenb
check "and its value is good" await_quality 2 $good 30
print_log
stop_baudgate

chapter "$failed failed"
host result "$failed failed"
