#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The tool by mpirun and with a work directory, killed and resumed: the same bytes. Run by ctest.
#   ranks.sh RECONSTRUCTION SCAN MPIRUN SCRATCH
set -euo pipefail

reconstruction=$1 scan=$2 mpirun=$3 scratch=$4
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 # in a container root may be all there is
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
fail() {
  echo "ranks: $*" >&2
  exit 1
}

"$scan" torus cloud.ply --points 60000 --quiet
# So little memory that the finest level is in tiles, and the mesh in parts.
unlimited=(--quality fine --dense-voxels 60000 --report)
options=(--max-memory 35 "${unlimited[@]}")
expected=
for ranks in 1 2 5; do
  "$mpirun" --oversubscribe -n $ranks "$reconstruction" cloud.ply mesh$ranks.ply "${options[@]}" report$ranks.json
  sum=$(sha256sum <mesh$ranks.ply)
  [ "${expected:=$sum}" = "$sum" ] || fail "$ranks ranks make other bytes than 1"
done
grep -q '"tiles": [2-9]' report5.json || fail "the finest level was not in tiles"

# What all ranks see, one of them tells, also where the module is missing.
[ "$("$mpirun" --oversubscribe -n 3 "$reconstruction" --version | wc -l)" = 1 ] || fail "each rank has a version"
[ "$("$mpirun" --oversubscribe -n 3 "$reconstruction" --none 2>&1 | grep -c reconstruction:)" = 1 ] ||
  fail "each rank tells of a wrong option"
library=$(ldd "$reconstruction" | awk '/libpcl_mrf\.so/ { print $3 }')
if [ -n "$library" ]; then # else it is in the tool
  mkdir alone
  cp -L "$library" alone
  [ "$(LD_LIBRARY_PATH=$PWD/alone "$mpirun" --oversubscribe -n 3 "$reconstruction" cloud.ply mesh.ply 2>&1 |
    grep -c 'reconstruction: several processes need')" = 1 ] || fail "each rank tells of a missing module"
fi
PMI_RANK=0 PMI_SIZE=3 "$reconstruction" cloud.ply mesh.ply -q 2>&1 | grep -q '^warning: 3 processes were started, each' ||
  fail "nothing tells of a launcher that is not Open MPI's"

# Killed as soon as there is a result, by ranks and without; then to its end.
for command in "$mpirun --oversubscribe -n 2" ""; do
  $command "$reconstruction" cloud.ply resumed.ply "${options[@]}" resumed.json --work-directory work &
  run=$!
  while kill -0 $run 2>/dev/null && ! ls work/*.result >/dev/null 2>&1; do sleep .02; done
  pkill -9 -f -- "cloud.ply resumed.ply" || fail "it was done before it could be killed"
  wait $run && fail "it was not killed"
  [ ! -e resumed.ply ] || fail "a killed run leaves a mesh"
  "$reconstruction" cloud.ply resumed.ply "${options[@]}" resumed.json --work-directory work &&
    fail "results of an earlier run are taken without being asked for"
  $command "$reconstruction" cloud.ply other.ply --max-memory 400 "${unlimited[@]}" other.json --work-directory work --resume
  grep -q 'its parts were cut for --max-memory 35, and this run has 400' other.json ||
    fail "nothing tells why another limit resumes nothing"
  # With the first run's limit, which the journal has.
  $command "$reconstruction" cloud.ply resumed.ply "${unlimited[@]}" resumed.json --work-directory work --resume |
    tee resumed.txt
  grep -qE '^ +[1-9][0-9]* of [0-9]+ parts of the run were there' resumed.txt || fail "nothing was resumed"
  [ "$(sha256sum <resumed.ply)" = "$expected" ] || fail "a resumed run makes other bytes"
  [ ! -e work ] || fail "the work directory is left behind"
  rm resumed.ply
done
echo "ranks: same bytes of 1, 2 and 5, and after a kill"
