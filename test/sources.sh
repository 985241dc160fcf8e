#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every source file says what it is under. Run by ctest with the source directory.
set -euo pipefail
cd "$1"

count=0 failed=0
while read -r file; do
  count=$((count + 1))
  head -n 2 "$file" | grep -q 'SPDX-License-Identifier: BSD-3-Clause' || {
    echo "$file: no SPDX line at its beginning" >&2
    failed=1
  }
done < <(find CMakeLists.txt include src apps test cmake -type f \
  \( -name '*.cpp' -o -name '*.h' -o -name '*.hpp' -o -name '*.sh' -o -name '*.cmake' -o -name CMakeLists.txt \))
echo "$count source files"
[ "$count" -gt 100 ] || failed=1
exit "$failed"
