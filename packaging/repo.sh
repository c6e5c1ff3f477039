#!/usr/bin/env bash
# Makes a signed apt repository from packages of packaging/deb.sh, or adds packages to it: for Debian 12 on amd64 and arm64.
# usage: packaging/repo.sh FOLDER KEY PACKAGE…    for example packaging/repo.sh /srv/apt 0123ABCD build/deb/*.deb build/deb-arm64/*.deb
# KEY is the number or address of a secret key of GnuPG, which signs. Needs the packages reprepro and gnupg. The folder has the
# newest added version of each package. BAUDGATE_REPOSITORY is the address at which users reach the folder, for the printed lines.
set -euo pipefail

[ $# -ge 3 ] || { sed -n '2,/^set /{/^#/s/^# //p}' "$0" >&2; exit 2; }
folder=$1 key=$2
shift 2
fail() { echo "repo.sh: $*" >&2; exit 1; }
for tool in reprepro gpg; do
  command -v "$tool" >/dev/null || fail "$tool is missing: apt install reprepro gnupg"
done
for package in "$@"; do
  dpkg-deb --field "$package" Package >/dev/null || fail "$package is no Debian package"
done
# A short number may belong to several keys, so the fingerprint of the first secret key is used everywhere.
fingerprint=$(gpg --batch --with-colons --list-secret-keys "$key" 2>/dev/null | awk -F: '/^fpr/ && !found { found = $10 } END { print found }' || true)
[ -n "$fingerprint" ] || fail "GnuPG has no secret key '$key'"

mkdir -p "$folder/conf"
folder=$(realpath "$folder")
signer=$(sed -n 's/^SignWith: //p' "$folder/conf/distributions" 2>/dev/null || true)
[ -z "$signer" ] || [ "$signer" = "$fingerprint" ] ||
  fail "key $signer signs $folder; to change the key, change SignWith in conf/distributions, and give all users the new key"
cat >"$folder/conf/distributions" <<END_OF_FILE
Origin: baudgate
Label: baudgate
Codename: bookworm
Architectures: amd64 arm64
Components: main
Description: baudgate for Debian 12
SignWith: $fingerprint
END_OF_FILE
gpg --batch --yes --output "$folder/baudgate.gpg" --export "$fingerprint"
reprepro --silent --basedir "$folder" includedeb bookworm "$@"
# Signs again also if all packages were there already.
reprepro --silent --basedir "$folder" export bookworm
reprepro --basedir "$folder" list bookworm

at=${BAUDGATE_REPOSITORY:-file://$folder}
cat <<END_OF_FILE

A user of apt needs these two lines, as root:
curl -fsS $at/baudgate.gpg -o /etc/apt/keyrings/baudgate.gpg
echo 'deb [signed-by=/etc/apt/keyrings/baudgate.gpg] $at bookworm main' >/etc/apt/sources.list.d/baudgate.list
END_OF_FILE
