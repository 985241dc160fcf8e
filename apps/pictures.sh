#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the README's pictures out of those of the experiments. Needs the built tools and ImageMagick.
# usage: apps/pictures.sh [BUILD_FOLDER [RESULTS_FOLDER]]
# What RESULTS_FOLDER already holds is neither computed nor drawn again.
set -euo pipefail

source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build_dir=${1:-$source_dir/build}
results=${2:-$build_dir/pictures}

"$build_dir/bin/pcl_mrf_experiments" -o "$results" --only fig-5,guide
for pair in holes:fig-5 before-after:guide-holes noisy:guide-noisy sparse:guide-sparse open:guide-open \
  large-hole:guide-large-hole error-bars:uncertainty worst-hole:table-1-worst; do
  # The last two are there if their experiments were run into the same folder.
  if [ -e "$results/${pair#*:}.png" ]; then
    convert "$results/${pair#*:}.png" -trim -bordercolor white -border 4 -resize '1280x>' -strip -interlace Plane \
      -sampling-factor 4:2:0 -quality 84 "$source_dir/apps/pictures/${pair%%:*}.jpg"
  fi
done
du -ch "$source_dir"/apps/pictures/*.jpg | tail -n 1
