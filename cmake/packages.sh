#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Makes the Debian packages.
#   packages.sh [DIRECTORY [CMAKE OPTION...]]   DIRECTORY: to build in and to leave them in, build-packages unless given
set -eu

source_dir=$(cd "$(dirname "$0")/.." && pwd)
build_dir=${1:-$source_dir/build-packages}
[ $# -eq 0 ] || shift

sh "$source_dir/cmake/install_packages.sh"
mkdir -p "$build_dir"
rm -f "$build_dir"/*.deb
if ! { cmake -S "$source_dir" -B "$build_dir" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr \
  -DMRF_BUILD_TESTS=OFF "$@" && cmake --build "$build_dir" --target package; } >"$build_dir/packages.log" 2>&1; then
  tail -n 40 "$build_dir/packages.log" >&2
  exit 1
fi
ls "$build_dir"/*.deb
