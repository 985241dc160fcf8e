#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every source file says what it is under, and spells as PCL does; README and example agree. Run by ctest with the source directory.
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
  \( -name '*.cpp' -o -name '*.h' -o -name '*.hpp' -o -name '*.sh' -o -name '*.py' -o -name '*.cmake' -o -name CMakeLists.txt \))
echo "$count source files"

# Names are typed from memory: one spelling, American as PCL's. (The test of the help types the other on purpose.)
british='colour|neighbour|centre|centring|(regular|normal|factor|minim|optim|summar|initial|discret|organ)is(e|ing|ation)'
if grep -rniE "$british|behaviour|catalogue" include src apps test --include='*.cpp' --include='*.h' --include='*.hpp' --include='*.py' \
  --include=CMakeLists.txt --exclude=test_tool_help.cpp; then
  echo "sources: spelled as in Britain" >&2
  failed=1
fi

# The program that the README shows is the one that is built and run.
shown=$(sed -n '/^```cpp$/,/^```$/p' README.md | sed '1d;$d')
[ "$shown" = "$(sed 1,2d apps/examples/files_to_mesh.cpp)" ] || {
  echo "README.md: its program is not apps/examples/files_to_mesh.cpp" >&2
  failed=1
}
[ "$count" -gt 100 ] || failed=1
exit "$failed"
