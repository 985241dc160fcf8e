#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs whole programs side by side on the same clouds and prints a table: processor seconds (user + system, of all
# threads, reading and writing included), wall seconds, peak memory, accuracy and hole error. PCL's tools come with
# pcl-tools; PoissonRecon and SSDRecon take part if they are on PATH.
#   bash test/benchmark/side_by_side.sh                      a scan of 28,553 points, and one of 3 million
#   bash test/benchmark/side_by_side.sh --cases "$(ls ../shared/data/real)" --methods 'remeshed, one|Poisson'
#   bash test/benchmark/side_by_side.sh --cases 30m          30 million points: this tool only, 24 GB
#   --build DIR      of this project; default: build
#   --clouds DIR     where clouds are made, once; default: clouds in the build directory
#   --cases LIST     of start, clean, 1m, 3m, 30m, and folders of scans beside the project; default "clean 3m"
#   --methods REGEX  only methods whose name it matches
#   --runs N         of each program, in turns; the medians are printed; default 5
set -euo pipefail
export LC_ALL=C

usage() {
  sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "${BASH_SOURCE[0]}"
  exit "$1"
}

source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
data=$source_dir/../shared/data
build=$source_dir/build
clouds=
cases='clean 3m'
methods=.
runs=5
while [ $# -gt 0 ]; do
  case $1 in
  --help) usage 0 ;;
  --build | --clouds | --cases | --methods | --runs)
    [ $# -gt 1 ] || usage 2 >&2
    name=${1#--}
    printf -v "$name" %s "$2"
    shift
    ;;
  *) usage 2 >&2 ;;
  esac
  shift
done
clouds=${clouds:-$build/clouds}
[[ $runs =~ ^[1-9][0-9]*$ ]] || usage 2 >&2
gnu_time=$(type -P time) || {
  echo 'side_by_side.sh: needs GNU time (Debian package time)' >&2
  exit 1
}
for tool in pcl_mrf_reconstruction pcl_mrf_evaluate pcl_mrf_scan; do
  [ -x "$build/bin/$tool" ] || {
    echo "side_by_side.sh: $build/bin/$tool is not built" >&2
    exit 1
  }
done
mkdir -p "$clouds"
folder=$(mktemp -d "${TMPDIR:-/tmp}/side_by_side.XXXXXX")
trap 'rm -rf "$folder"' EXIT

# scan NAME POINTS: a cloud of the reference head.
scan() {
  [ -f "$clouds/$1.ply" ] && [ -f "$clouds/$1_heldout.ply" ] && return
  local mesh=$data/reference/igea.ply
  [ -f "$mesh" ] || mesh=/usr/share/glmark2/models/bunny.obj
  echo "scanning $2 points of $(basename "$mesh")" >&2
  "$build/bin/pcl_mrf_scan" "$mesh" "$clouds/$1.ply" --quiet --points "$2" --holes 3 --hole-radius 3% \
    --write-held-out "$clouds/$1_heldout.ply"
}

# Sets cloud, held_out and depth.
prepare() {
  depth=8
  case $1 in
  start)
    scan igea_1k 1000
    cloud=$clouds/igea_1k.ply held_out=$clouds/igea_1k_heldout.ply
    ;;
  clean)
    cloud=$data/igea_clean/input.ply held_out=$data/igea_clean/heldout.ply
    if [ ! -f "$cloud" ]; then
      echo "side_by_side.sh: no $cloud: a simulated scan of as many points instead" >&2
      scan igea_30k 30000
      cloud=$clouds/igea_30k.ply held_out=$clouds/igea_30k_heldout.ply
    fi
    ;;
  1m | 3m | 30m)
    depth=9
    scan "igea_$1" "${1%m}000000"
    cloud=$clouds/igea_$1.ply held_out=$clouds/igea_$1_heldout.ply
    ;;
  *)
    local scans
    for scans in "$data/$1" "$data/real/$1"; do
      cloud=$scans/input.ply held_out=$scans/heldout.ply
      [ ! -f "$cloud" ] || break
    done
    [ -f "$cloud" ] || {
      echo "side_by_side.sh: no case '$1'" >&2
      exit 2
    }
    [[ $scans != */real/* ]] || depth=9
    ;;
  esac
  pcd=$clouds/$(basename "$(dirname "$cloud")")-$(basename "$cloud" .ply).pcd
  if [ "$1" != 30m ] && [ ! -f "$pcd" ]; then
    pcl_ply2pcd "$cloud" "$pcd" >/dev/null 2>&1
  fi
}

# The methods of a case: name, tab, format of its mesh, tab, command.
list_methods() {
  local ours="$build/bin/pcl_mrf_reconstruction $cloud MESH --quiet"
  printf 'this\tply\t%s\n' "$ours --no-remesh"
  printf 'this, one thread\tply\t%s\n' "$ours --no-remesh --threads 1"
  [ "$1" = 30m ] && return
  printf 'this, k = 2\tply\t%s\n' "$ours --no-remesh --prior thin-plate"
  printf 'this, fine\tply\t%s\n' "$ours --no-remesh --quality fine"
  printf 'this, remeshed\tply\t%s\n' "$ours"
  printf 'this, remeshed, one thread\tply\t%s\n' "$ours --threads 1"
  printf 'pcl::Poisson, depth %s\tvtk\t%s\n' "$depth" "pcl_poisson_reconstruction $pcd MESH -depth $depth"
  printf 'pcl::MarchingCubesHoppe, 128\tvtk\t%s\n' "pcl_marching_cubes_reconstruction $pcd MESH -grid_res 128"
  local peer path
  for peer in PoissonRecon SSDRecon; do
    path=$(type -P "$peer") || continue
    printf '%s, depth %s\tply\t%s\n' "$peer" "$depth" "$path --in $cloud --out MESH --depth $depth"
  done
}

median() {
  sort -g | awk '{ value[NR] = $1 } END { print (value[int((NR + 1) / 2)] + value[int(NR / 2) + 1]) / 2 }'
}

# column N: the median of a figure over the runs
column() {
  awk -v n="$1" '{ print $n }' "$folder/$2.times" | median
}

# A figure that pcl_mrf_evaluate prints: of a table's row the second column, the RMS.
figure() {
  awk -v name="$1" '$1 == name { print (NF > 2 ? $3 : $2); exit }' "$folder/evaluation"
}

echo '| cloud | program | CPU s | of Poisson | wall s | peak MB | accuracy % | holes % | triangles |'
echo '|---|---|---|---|---|---|---|---|---|'
for case in $cases; do
  prepare "$case"
  mapfile -t chosen < <(list_methods "$case" | awk -F '\t' -v methods="$methods" '$1 ~ methods')
  # In turns, so that a slow minute of the machine is everybody's.
  for ((run = 0; run < runs; ++run)); do
    for i in "${!chosen[@]}"; do
      IFS=$'\t' read -r name format command <<<"${chosen[i]}"
      [ ! -f "$folder/$case-$i.failed" ] || continue
      IFS=' ' read -r -a words <<<"${command/MESH/$folder/$case-$i.$format}"
      if "$gnu_time" -o "$folder/time" -f '%U %S %e %M' "${words[@]}" >"$folder/log" 2>&1; then
        awk '{ print $1 + $2, $3, $4 / 1024 }' "$folder/time" >>"$folder/$case-$i.times"
      else
        echo "side_by_side.sh: $name failed on $case: $(tail -n 1 "$folder/log")" >&2
        touch "$folder/$case-$i.failed"
      fi
    done
  done

  poisson=
  for i in "${!chosen[@]}"; do
    if [[ ${chosen[i]} == pcl::Poisson* ]] && [ ! -f "$folder/$case-$i.failed" ]; then
      poisson=$(column 1 "$case-$i")
    fi
  done
  for i in "${!chosen[@]}"; do
    IFS=$'\t' read -r name format command <<<"${chosen[i]}"
    if [ -f "$folder/$case-$i.failed" ]; then
      echo "| $case | $name | failed | | | | | | |"
      continue
    fi
    # PCL's marching cubes give every triangle its own corners.
    if [ "$format" = vtk ]; then
      pcl_vtk2ply "$folder/$case-$i.vtk" "$folder/$case-$i.ply" >/dev/null 2>&1
    fi
    "$build/bin/pcl_mrf_evaluate" "$folder/$case-$i.ply" --merge --input "$cloud" --held-out "$held_out" \
      --samples 1 >"$folder/evaluation" 2>"$folder/log" || cat "$folder/log" >&2
    processor=$(column 1 "$case-$i")
    awk -v case="$case" -v name="$name" -v cpu="$processor" -v poisson="$poisson" -v wall="$(column 2 "$case-$i")" \
      -v memory="$(column 3 "$case-$i")" -v accuracy="$(figure cloudPercent)" \
      -v holes="$(figure heldOutPercent)" -v triangles="$(figure triangles)" 'BEGIN {
        ratio = poisson == "" ? "" : sprintf("%.2f", cpu / poisson)
        printf "| %s | %s | %.2f | %s | %.2f | %.0f | %s | %s | %s |\n", case, name, cpu, ratio, wall, memory, accuracy,
          holes, triangles
      }'
    rm -f "$folder/$case-$i".{ply,vtk}
  done
done
