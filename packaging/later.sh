# Sourced by what tries an upgrade of the packages.

# later DEB OUT: the same package, one version on, with another configuration as its default.
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
