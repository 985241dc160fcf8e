#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every C++ file is laid out as clang-format 14 does it. Run by ctest with the source directory; 77: no clang-format 14 here.
set -euo pipefail
cd "$1"

formatter=$(type -P clang-format-14 || type -P clang-format || true)
if [ -z "$formatter" ] || ! "$formatter" --version | grep -q 'version 14\.'; then
  echo "format: skipped, there is no clang-format 14 here"
  exit 77
fi
find include src apps test -type f \( -name '*.cpp' -o -name '*.h' -o -name '*.hpp' \) -print0 |
  xargs -0 -n 40 "$formatter" --dry-run -Werror
