# Sourced by checks.sh where the packages are installed: a later version over the running service, the way back, removal.
# SPDX-License-Identifier: Apache-2.0

readonly config=/etc/baudgate/baudgate.yaml
install_over() { DEBIAN_FRONTEND=noninteractive dpkg --force-confold -i "$@" >/test/dpkg.log 2>&1 || { cat /test/dpkg.log; false; }; }
installed() { dpkg-query -W -f '${Version}\n' baudgate baudgate-dds | sort -u; }
writes_known() { baudgate writes --json | jq -s length; }
nobody_is() { ! pgrep -u "$1" >/dev/null; }  # USER

replaced() {  # WHAT DEB…
  local what=$1 process version
  shift
  process=$(main_process baudgate)
  version=$(dpkg-deb -f "$1" Version)
  check "$what: dpkg takes it" install_over "$@"
  check "$what: both are $version" [ "$(installed)" = "$version" ]
  check "$what: the edited configuration is kept" [ "$(tail -n 1 $config)" = "# edited" ]
  check "$what: for the service only" [ "$(stat -c '%a %U:%G' $config)" = "640 root:baudgate" ]
  check "$what: another process" eventually $patience another_process baudgate "$process"
  check "$what: systemd has read its units" [ "$(property baudgate NeedDaemonReload)" = no ]
  eventually $patience daemon_is_up
  whole "$what"
  check "$what: writes of before are known" [ "$(writes_known)" = "$writes" ]
}

chapter "14 A later version over the running one, and back"
cp /test/baudgate.yaml $config
echo "# edited" >>$config
chown root:baudgate $config
chmod 640 $config
systemctl restart baudgate
eventually $patience daemon_is_up
writes=$(writes_known)
check "there are writes to be kept" [ "$writes" -ge 1 ]
replaced "upgrade" /packages/later/*.deb
replaced "the version before" /packages/*.deb
print_journal

chapter "15 Removed, then purged"
check "dpkg removes both" dpkg -r baudgate-dds baudgate
check "neither runs" [ "$(systemctl is-active baudgate baudgate-dds | sort -u)" = inactive ]
check "no process is left" eventually 10 nobody_is baudgate
check "configuration and state are" test -e $config -a -e /var/lib/baudgate/plant/events.db
check "dpkg purges both" dpkg -P baudgate-dds baudgate
check "and they are gone" not ls /etc/baudgate /var/lib/baudgate
check "systemd knows no unit of theirs" not systemctl cat baudgate baudgate-dds
