# Runs in the virtual machine as a service; each check is a line PASS or FAIL.
# SPDX-License-Identifier: Apache-2.0
. /test/tools.sh

both="baudgate baudgate-dds"
daemon_is_up() { active baudgate && active baudgate-dds && dds_is up; }

restart_with() {  # SED-SCRIPT over the configuration
  sed "$1" /test/baudgate.yaml >/etc/baudgate/baudgate.yaml
  systemctl restart baudgate
  eventually $patience daemon_is_up
}

whole() {  # WHAT: both outputs serve both lines
  check "$1: Modbus reads the twin behind ttyS1" eventually $patience reads 1 0 1.5
  check "$1: Modbus reads the twin on a pty" eventually $patience reads 2 2 2.5
  check "$1: a subscriber gets both" eventually $patience subscriber_gets_both
}

killed() {  # UNIT
  local before process
  process=$(main_process "$1")
  before=$(restarts "$1")
  systemctl kill --signal=KILL --kill-who=main "$1"
  check "kill -9 of $1: another process" eventually $patience another_process "$1" "$process"
  echo "  observed: after $took s"
  check "kill -9 of $1: systemd has counted it" [ "$(restarts "$1")" -gt "$before" ]
  eventually $patience daemon_is_up
  whole "kill -9 of $1"
}

# From the first unit that was told to end to the last that had ended, without systemctl's own time.
stop_took() {
  local unit
  for unit in $both; do
    property "$unit" ActiveExitTimestampMonotonic
    property "$unit" InactiveEnterTimestampMonotonic
  done | sort -n | awk 'NR == 1 { first = $1 } { last = $1 } END { printf "%.2f", (last - first) / 1e6 }'
}

# The unit has at most this exposure, by systemd's own reckoning.
sandboxed() {  # UNIT LIMIT
  local level
  level=$(exposure "$1")
  check "exposure of $1 is $level, at most $2" at_most "${level:-10}" "$2"
}

reload_fails() { ! systemctl reload baudgate; }
changes_nothing() { baudgate reload --dry-run | grep -q "nothing has changed"; }
refused_in_journal() { journalctl -b -u baudgate | grep -q "baudgate.yaml:1:"; }

cp /etc/baudgate/baudgate.yaml /test
systemctl --version | head -n 1
echo "$(uname -sr), $(nproc) processors, $(systemd-detect-virt)"
make_network
start_twins
# It waits for its address no longer than RestartSec.
systemctl restart baudgate-dds

chapter "1 Booted"
check "PID 1 is systemd" [ "$(cat /proc/1/comm)" = systemd ]
check "baudgate is active: it said READY" eventually $patience active baudgate
check "baudgate-dds is active, though nobody enabled it" eventually $patience active baudgate-dds
check "Type=notify" [ "$(property baudgate Type) $(property baudgate-dds Type)" = "notify notify" ]
check "each is a user of its own" \
  [ "$(stat -c %U /proc/"$(main_process baudgate)" /proc/"$(main_process baudgate-dds)" | paste -sd' ')" = "$both" ]
whole "booted"
check "status says that DDS is up" dds_is up
print_journal

chapter "2 State: a write is kept"
check "a write over Modbus" in_plant mbpoll -m tcp -p 502 -a 1 -0 -r 2 -t 4:float -B -q 10.9.0.1 7.25
check "is read back from the twin" eventually $patience reads 1 2 7.25
state=/var/lib/baudgate
check "the state folder is the service's: $(stat -c '%U:%G %a' $state)" [ "$(stat -c %U:%G $state)" = baudgate:baudgate ]
check "events.db is there: $(stat -c '%U:%G %a' $state/plant/events.db)" \
  [ "$(stat -c %U:%G $state/plant/events.db)" = baudgate:baudgate ]
check "nobody but the gateway writes it" [ -z "$(find $state -perm /022)" ]
check "others do not read it" [ "$(stat -c %a $state)" = 750 ]
check "baudgate writes knows it" [ "$(baudgate writes --json | jq -s '[.[] | select(.outcome == "ok")] | length')" = 1 ]
print_journal

chapter "3 kill -9"
killed baudgate-dds
check "the gateway's status counts it" [ "$(status .dds.times_lost)" -ge 1 ]
killed baudgate
check "the write is still known" [ "$(baudgate writes --json | jq -s length)" -ge 1 ]
print_journal

chapter "4 Reload"
begin_reading
process=$(main_process baudgate)
sed '/name: second/s/poll: 500ms/poll: 400ms/' /test/baudgate.yaml >/etc/baudgate/baudgate.yaml
check "systemctl reload" systemctl reload baudgate
check "it has been taken in" eventually $patience changes_nothing
check "by the same process" [ "$(main_process baudgate)" = "$process" ]
check "the line that has changed is read" eventually $patience reads 2 2 2.5
echo "lines: 7" >/etc/baudgate/baudgate.yaml
check "a bad file: systemctl says no" reload_fails
check "a bad file: the journal says so" eventually $patience refused_in_journal
check "and the gateway runs" [ "$(main_process baudgate)" = "$process" ]
cp /test/baudgate.yaml /etc/baudgate/baudgate.yaml
systemctl reload baudgate
check "back again" eventually $patience changes_nothing
answers=$(end_reading)
check "Modbus meanwhile: $answers" grep -q '^[1-9][0-9]* good, 0 other$' <<<"$answers"
print_journal

chapter "5 baudgate-dds is stopped (SIGSTOP)"
begin_reading
process=$(main_process baudgate-dds)
systemctl kill --signal=STOP baudgate-dds
check "status says that it is silent" eventually $patience dds_is silent
check "it is given up and started again" eventually $patience another_process baudgate-dds "$process"
echo "  observed: after $took s"
check "DDS is up again" eventually $patience dds_is up
check "a subscriber gets both" eventually $patience subscriber_gets_both
answers=$(end_reading)
check "Modbus meanwhile: $answers" grep -q '^[1-9][0-9]* good, 0 other$' <<<"$answers"
print_journal

chapter "6 Memory limit of baudgate-dds"
begin_reading
mkdir -p /run/systemd/system/baudgate-dds.service.d
printf '[Service]\nMemoryMax=4M\n' >/run/systemd/system/baudgate-dds.service.d/small.conf
systemctl daemon-reload
before=$(restarts baudgate-dds)
systemctl --no-block restart baudgate-dds
killed_for_memory() { journalctl -b -u baudgate-dds | grep -q "oom-kill"; }
check "systemd ends it for its memory" eventually $patience killed_for_memory
sleep 3
check "the gateway runs" active baudgate
check "its status says that DDS is not there" [ "$(status .dds.state)" != up ]
rm -r /run/systemd/system/baudgate-dds.service.d
systemctl daemon-reload
systemctl restart baudgate-dds
check "with its own limit DDS is up again" eventually $patience dds_is up
check "a subscriber gets both" eventually $patience subscriber_gets_both
answers=$(end_reading)
check "Modbus meanwhile: $answers" grep -q '^[1-9][0-9]* good, 0 other$' <<<"$answers"
print_journal

chapter "7 Stop, start, restart"
in_plant baudgate watch --interface 10.9.0.2 --json >/run/last 2>&1 &
watcher=$!
check "a subscriber has begun" eventually $patience grep -q '^{' /run/last
systemctl stop baudgate
took=$(stop_took)
check "both units stopped within $took s, at most 2" at_most "$took" 2
check "and took baudgate-dds along" [ "$(systemctl is-active baudgate-dds)" = inactive ]
check "nothing failed" [ "$(property baudgate Result) $(property baudgate-dds Result)" = "success success" ]
sleep 1
kill $watcher
wait $watcher 2>/dev/null
last=$(jq -rs '[.[] | select(.quality)] | group_by(.device + .point) | map(.[-1].quality) | unique | map(tostring) | join(" ")' \
  <(grep '^{' /run/last))
check "the last words on every point: quality 8 (seen: $last)" [ "$last" = 8 ]
systemctl start baudgate
whole "start"
before="$(main_process baudgate) $(main_process baudgate-dds)"
timed systemctl restart baudgate
echo "  observed: restart took $took s"
both_new() { another_process baudgate "${before% *}" && another_process baudgate-dds "${before#* }"; }
check "restart: both are new processes" eventually $patience both_new
whole "restart"
print_journal

chapter "8 A bad configuration"
echo "nonsense: [" >/etc/baudgate/baudgate.yaml
systemctl restart baudgate 2>/dev/null
sleep 8
check "is not tried again: exit code $(property baudgate ExecMainStatus)" \
  [ "$(property baudgate ExecMainStatus) $(systemctl is-active baudgate)" = "3 failed" ]
print_journal

chapter "9 Discovery server"
restart_with 's/discovery_servers/multicast: false, &/'
mkdir -p /run/systemd/system/baudgate-discovery.service.d
printf '[Service]\nEnvironment=BAUDGATE_DISCOVERY_LISTEN=10.9.0.1:11811\n' \
  >/run/systemd/system/baudgate-discovery.service.d/listen.conf
systemctl daemon-reload
check "without a server a subscriber gets nothing" \
  [ -z "$(watch_once --no-multicast --discovery-server 10.9.0.1:11811)" ]
systemctl start baudgate-discovery
check "it is active" active baudgate-discovery
by_server() { subscriber_gets_both --no-multicast --discovery-server 10.9.0.1:11811; }
check "with it a subscriber gets values" eventually $patience by_server
process=$(main_process baudgate-discovery)
systemctl kill --signal=KILL baudgate-discovery
check "kill -9: another process" eventually $patience another_process baudgate-discovery "$process"
check "and a subscriber gets values" eventually $patience by_server
systemctl stop baudgate-discovery
check "it stops" [ "$(systemctl is-active baudgate-discovery)" = inactive ]
print_journal

chapter "10 What they may reach"
for unit in $both baudgate-discovery; do
  echo "  -- $unit"
  systemd-analyze security --no-pager "$unit" | grep -E '✗|→' | sed 's/^/  /'
done
sandboxed baudgate 1.8
sandboxed baudgate-dds 1.3
sandboxed baudgate-discovery 1.3
check "it writes its state and its sockets" inside_service sh -c 'touch /var/lib/baudgate/a /run/baudgate/a && rm /var/lib/baudgate/a /run/baudgate/a'
for folder in /etc /usr /opt /srv /var/log /boot /proc/sys/kernel /sys/kernel /sys/fs/cgroup; do
  check "it does not write $folder" not inside_service touch $folder/a
done
check "homes are empty for it" [ -z "$(inside_service ls -A /home)$(inside_service ls -A /root)" ]
touch /tmp/of-others
check "and /tmp is its own" not inside_service test -e /tmp/of-others
check "it sees which process locks a port" inside_service test -e /proc/locks
check "one capability, that for port 502" [ "$(process_state CapEff) $(process_state CapBnd)" = "0000000000000400 0000000000000400" ]
check "no new ones, and a filter on system calls" [ "$(process_state NoNewPrivs) $(process_state Seccomp)" = "1 2" ]
check "its group may open serial ports" service_opens /dev/ttyS2
check "and ptys" service_opens /dev/ptmx
for device in /dev/vda /dev/kmsg /dev/mem /dev/loop-control; do
  [ ! -e $device ] || check "not $device" not service_opens $device
done
print_journal

chapter "11 A USB adapter, the first of its kind since the service runs"
check "modules-load.d has loaded usbserial" grep -qw ttyUSB /proc/devices
modprobe -r ftdi_sio usbserial
check "now there is no driver" not grep -qw ttyUSB /proc/devices
restart_with ''
whole "without it"
check "quality of its values is 8" eventually $patience quality_is 3 8
adapter 1
check "plugged in: udev has named it" eventually $patience test -e /dev/baudgate/sn-BG1
check "and by place" [ -n "$(ls /dev/baudgate/at-* 2>/dev/null)" ]
check "its waiting time is 1 ms" [ "$(cat /sys/class/tty/ttyUSB0/device/latency_timer)" = 1 ]
check "it is read" eventually $patience reads 3 2 2.5
echo "  observed: after $took s"
baudgate ports | sed 's/^/  /'
check "ports: the line has it" [ "$(baudgate ports --json | jq -r '.ports[] | select(.port == "/dev/ttyUSB0") | .held_by[0]')" = "line usb of plant (open)" ]
check "ports: nothing is missing" [ "$(baudgate ports --json | jq '[.ports[] | select(.port == "/dev/ttyUSB0") | .advice[]] | length')" = 0 ]
adapter 0
check "unplugged: quality 8" eventually $patience quality_is 3 8
check "the others are served" eventually $patience reads 1 0 1.5
adapter 1
check "plugged in again: it is read" eventually $patience reads 3 2 2.5
check "the journal knows of lines" grep -q 'is gone' <(journal_of LINE=usb OUTCOME=line_down)
check "and of devices" grep -q 'online' <(journal_of LINE=usb DEVICE=third)
print_journal

chapter "12 The gateway is stopped (SIGSTOP)"
check "systemd waits 10 s for a sign of life" [ "$(property baudgate WatchdogUSec)" = 10s ]
process=$(main_process baudgate)
systemctl kill --signal=STOP --kill-who=main baudgate
check "another process takes its place" eventually $patience another_process baudgate "$process"
echo "  observed: after $took s"
check "because of the watchdog" grep -q 'watchdog' <(journalctl -b -u baudgate -o cat | tail -n 40)
whole "after the watchdog"
systemctl stop baudgate
print_journal

[ ! -d /packages ] || . /test/upgrade.sh

chapter "$failed failed"
