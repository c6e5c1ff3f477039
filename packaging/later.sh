# A function for scripts that test an upgrade of the packages. Source this file.

# later DEB OUT: writes the same package with the next version and another default configuration.
later() {
  local tree sample=etc/baudgate/baudgate.yaml
  tree=$(mktemp -d)
  chmod 755 "$tree"
  dpkg-deb -R "$1" "$tree"
  sed -i 's/^Version: .*/&+later/; s/baudgate (= [^)]*/&+later/' "$tree/DEBIAN/control"
  [ ! -e "$tree/$sample" ] || echo '# of the later version' >>"$tree/$sample"
  dpkg-deb --root-owner-group -b "$tree" "$2" >/dev/null
  rm -rf "$tree"
}
