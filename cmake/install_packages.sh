#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Installs the packages of packages.txt, and those given, that are missing. Needs root or sudo only if one is.
set -eu

list=$(dirname "$0")/packages.txt

missing=
for package in $(grep -v '^#' "$list") "$@"; do
  state=$(dpkg-query --show --showformat '${Status}' "$package" 2>/dev/null) || state=
  [ "$state" = 'install ok installed' ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null; then
  echo "install_packages.sh: no apt-get here; install the counterparts of:$missing" >&2
  exit 1
fi
as_root=
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install_packages.sh: run as root, or install sudo; missing:$missing" >&2
    exit 1
  fi
  as_root=sudo
fi

echo "installing:$missing"
# The variable is set behind sudo, which drops the caller's environment.
apt() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq "$@" </dev/null; }
apt update
# shellcheck disable=SC2086 # one word per package
apt install --yes --no-install-recommends -o Dpkg::Use-Pty=0 $missing >/dev/null
