#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every source file says what it is under, and spells as PCL does. Run by ctest with the source directory.
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

# Names are typed from memory: one spelling, American as PCL's. (The test of the help types the other on purpose.)
british='colour|neighbour|centre|centring|(regular|normal|factor|minim|optim|summar|initial|discret|organ)is(e|ing|ation)'
if grep -rniE "$british|behaviour|catalogue" include src apps test --include='*.cpp' --include='*.h' --include='*.hpp' \
  --include=CMakeLists.txt --exclude=test_tool_help.cpp; then
  echo "sources: spelled as in Britain" >&2
  failed=1
fi
[ "$count" -gt 100 ] || failed=1
exit "$failed"
