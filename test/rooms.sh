#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every include within the library follows an arrow of src/README.md. Run by ctest with the source directory.
set -euo pipefail
cd "$1"

declare -A allowed room
while IFS='|' read -r _ name _ _ may _; do
  name=${name//[\` ]/} may=${may//\`/}
  [ -d "src/$name" ] && [ -n "$name" ] || continue
  allowed[$name]=" $name $may "
done < <(grep '^| `' src/README.md)

failed=0
for folder in src/*/; do
  folder=$(basename "$folder")
  [ -n "${allowed[$folder]:-}" ] || {
    echo "src/$folder: src/README.md does not say what it may include" >&2
    failed=1
  }
  for file in src/"$folder"/*.cpp; do
    room[$(basename "$file" .cpp)]=$folder
  done
done
# Headers without a file of their own; what is asked of the error bars is an option like others.
room[lattice]=field room[exceptions]=base room[export]=base room[report]=run room[uncertainty]=options

includes=0
# check FILE ROOM: what it includes
check() {
  local target to
  while read -r target; do
    case $target in
    '<pcl/surface/mrf/'*) to=$(basename "${target%>}" .h) to=${room[$to]:-unknown:$to} ;;
    *) to=${target#'"'} to=${to%%/*} ;;
    esac
    includes=$((includes + 1))
    case ${allowed[$2]} in
    *" $to "* | *" all "*) ;;
    *)
      echo "$1: $2 must not include $to ($target)" >&2
      failed=1
      ;;
    esac
  done < <(sed -nE 's/^#include ("[a-z]+\/[a-z_]+\.h"|<pcl\/surface\/mrf\/[a-z_]+\.h>).*/\1/p' "$1")
}
for folder in "${!allowed[@]}"; do
  for file in src/"$folder"/*; do check "$file" "$folder"; done
done
for file in include/pcl/surface/mrf/*.h; do
  name=$(basename "$file" .h)
  check "$file" "${room[$name]:-unknown}"
done
echo "${#allowed[@]} folders, $includes includes"
[ "$includes" -gt 100 ] || failed=1
exit "$failed"
