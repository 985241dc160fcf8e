#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the README's pictures out of those of the experiments. Needs the built tool, xvfb-run and ImageMagick.
# usage: apps/pictures.sh [BUILD_FOLDER [RESULTS_FOLDER]]
# What RESULTS_FOLDER already holds of these experiments is not computed again. With MRF_PICTURES_ONLY_JOIN set nothing
# is: its pictures are put together as they are.
set -euo pipefail

source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build_dir=${1:-$source_dir/build}
results=${2:-$build_dir/pictures}
pictures=$source_dir/apps/pictures

mkdir -p "$results" "$pictures"
if [ "${MRF_PICTURES_ONLY_JOIN:-}" = "" ]; then
  xvfb-run -a "$build_dir/bin/pcl_mrf_experiments" -o "$results" --only fig-5,guide
fi

# strip NAME WIDTH FILE LABEL ...: tiles of this width side by side, each above its label.
strip() {
  local name=$1 width=$2 tiles=()
  shift 2
  while [ $# -gt 0 ]; do
    tiles+=(-label "$2" "$results/$1.png")
    shift 2
  done
  montage -font DejaVu-Sans -pointsize 15 -background white -fill '#333333' "${tiles[@]}" \
    -tile x1 -gravity north -geometry "${width}x+3+2" -strip -interlace Plane -sampling-factor 4:2:0 -quality 84 "$pictures/$name.jpg"
}

strip before-after 480 guide-holes-points 'scan with holes' guide-holes-default 'reconstruction; blue: no data'
strip holes 400 fig-5-k1 'k = 1, membrane' fig-5-k2 'k = 2, thin plate' fig-5-k3 'k = 3, triharmonic' \
  fig-5-poisson 'pcl::Poisson, depth 8'
strip noisy 320 guide-noisy-points 'noise of one mean spacing' guide-noisy-voxels '--observation plane' guide-noisy-default 'default'
strip sparse 320 guide-sparse-points '2,000 points' guide-sparse-default 'default' guide-sparse-fine '--quality fine'
strip open 320 guide-open-points 'seen from the front only' guide-open-none '--trim none; blue: no data' guide-open-default 'default'
strip large-hole 320 guide-large-hole-points 'radius: 22 %% of the diagonal' guide-large-hole-membrane \
  '--prior membrane; blue: no data' guide-large-hole-default 'default'

# The default's worst hole of Table 1, if that was run into the same folder.
worst=$(cd "$results" && ls table-1-worst-*-truth.png 2>/dev/null | head -n 1 || true)
if [ -n "$worst" ]; then
  worst=${worst%-truth.png}
  strip worst-hole 320 "$worst-truth" 'the object' "$worst-default" 'this' "$worst-poisson" 'pcl::Poisson, depth 8' \
    "$worst-hoppe" 'MarchingCubesHoppe, 128³'
fi

du -ch "$pictures"/*.jpg | tail -n 1
