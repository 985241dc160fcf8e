#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every include within the library follows an arrow of src/README.md, and every arrow is needed. Run by ctest with the source
# directory.
set -euo pipefail
cd "$1"

# An arrow is "from>to".
declare -A allowed used room
folders=$(find src -mindepth 1 -maxdepth 1 -type d -printf '%f\n' | sort)
failed=0
fail() {
  echo "rooms: $*" >&2
  failed=1
}
while IFS='|' read -r _ name _ _ may _; do
  name=${name//[\` ]/} may=${may//\`/}
  [ -d "src/$name" ] || fail "src/README.md has src/$name, which is not there"
  allowed["$name"]=1
  if [[ $may == *"all but"* ]]; then
    for to in $folders; do
      [[ " ${may#*but} " == *" $to "* ]] || [ "$to" = "$name" ] || allowed["$name>$to"]=1
    done
  else
    for to in $may; do allowed["$name>$to"]=1; done
  fi
done < <(grep '^| `[a-z]*` |' src/README.md)
for folder in $folders; do
  [ -n "${allowed[$folder]:-}" ] || fail "src/README.md does not say what src/$folder may include"
  unset "allowed[$folder]"
done

# Installed headers and their folders.
for entry in export:base exceptions:base execution:base lattice:base options:options option_table:options report:options \
  point_set:points neighbor_search:points distance_field:field triangle_mesh:mesh reconstruction:run; do
  room[${entry%:*}]=${entry#*:}
done
installed=$(find include -type f | wc -l)
[ "$installed" -le 14 ] || fail "$installed headers are installed, at most 14 are wanted"

includes=0
# check FILE FOLDER: what it includes
check() {
  local target to
  while read -r target; do
    case $target in
    '<pcl/surface/mrf/'*) to=$(basename "${target%>}" .h) to=${room[$to]:-unknown:$to} ;;
    *) to=${target#'"'} to=${to%%/*} ;;
    esac
    includes=$((includes + 1))
    [ "$to" != "$2" ] || continue
    used["$2>$to"]=1
    [ -n "${allowed["$2>$to"]:-}" ] || fail "$1: $2 must not include $to ($target)"
  done < <(sed -nE 's/^#include ("[a-z]+\/[a-z_]+\.h"|<pcl\/surface\/mrf\/[a-z_]+\.h>).*/\1/p' "$1")
}
for folder in $folders; do
  for file in src/"$folder"/*; do check "$file" "$folder"; done
done
for file in include/pcl/surface/mrf/*.h; do
  name=$(basename "$file" .h)
  [ -n "${room[$name]:-}" ] || fail "$file belongs to no folder"
  check "$file" "${room[$name]:-unknown}"
done
for file in include/pcl/surface/*.h include/pcl/surface/impl/*; do check "$file" run; done
for arrow in "${!allowed[@]}"; do
  [ -n "${used[$arrow]:-}" ] || fail "${arrow%>*} includes nothing of ${arrow#*>}: src/README.md need not allow it"
done
echo "$(wc -w <<<"$folders") folders, ${#used[@]} arrows, $includes includes, $installed installed headers"
[ "$includes" -gt 100 ] || failed=1
exit "$failed"
