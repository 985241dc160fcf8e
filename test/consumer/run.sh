#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs the consumer and the examples, without warnings. Run by ctest with the compiler in CXX, and with
# MRF_UNITY_BUILD as it is built with.
#   run.sh installed BUILD SCRATCH      installs BUILD and consumes it by find_package and by pkg-config
#   run.sh packages SOURCE SCRATCH      makes the Debian packages, unpacks them, and consumes what is in them
#   run.sh subdirectory SOURCE SCRATCH  consumes SOURCE as a subdirectory, static
set -euo pipefail

mode=$1 tree=$2 scratch=$3
here=$(cd "$(dirname "$0")" && pwd)
examples=$(cd "$here/../../apps/examples" && pwd)
flags='-Wall -Wextra -Werror'
rm -rf "$scratch"
mkdir -p "$scratch"

# The library is to be found by what was installed, not by what the caller's shell has set.
unset LD_LIBRARY_PATH CMAKE_PREFIX_PATH PKG_CONFIG_PATH

if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi

# build DIRECTORY TARGETS CMAKE_OPTION...
build() {
  cmake -S "$here" -B "$1" -G Ninja --log-level=WARNING "${@:3}" >/dev/null
  # shellcheck disable=SC2086 # targets are words
  cmake --build "$1" --target $2 >"$scratch/log" || { cat "$scratch/log"; exit 1; }
}

# A colored sphere with normals, of radius 1.
sphere() {
  awk 'BEGIN {
    n = 2000
    print "ply\nformat ascii 1.0\nelement vertex " n
    for (split("x y z normal_x normal_y normal_z", name); name[++k] != "";) print "property float " name[k]
    print "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header"
    for (i = 0; i < n; ++i) {
      z = 1 - (2 * i + 1) / n; r = sqrt(1 - z * z); a = 2.399963 * i; x = r * cos(a); y = r * sin(a)
      print x, y, z, x, y, z, 200, 120, 40
    }
  }'
}

# run_examples DIRECTORY: what each says, and leaves in its file.
run_examples() {
  local in=$scratch/sphere.ply out=$scratch/mesh
  sphere >"$in"
  sed '1,/end_header/d' "$in" | cut -d' ' -f1-3 >"$scratch/sphere.xyz"
  expect '^2000 of 2000 points, [1-9]' "$1/example_files_to_mesh" "$in" "$out.ply"
  expect 'poisson: [1-9]' "$1/example_poisson_replaced" poisson "$in" "$out.poisson.ply"
  expect 'ok: 2000 points, volume 4.1' "$1/example_poisson_replaced" mrf "$in" "$out.mrf.ply"
  if grep 'unknown field' "$scratch/said" "$scratch/error"; then exit 1; fi
  expect 'mean color 200 120 40' "$1/example_colors" "$in" "$out.colors.ply"
  expect 'the scan has no colors' "$1/example_colors" "$out.ply" "$out.colorless.ply"
  expect 'mean color 2[0-9][0-9] 1[0-9][0-9]' "$1/example_colors" "$in" "$out.confidence.ply" confidence
  expect ' vertices, mean intensity 0.50' "$1/example_own_points" "$scratch/sphere.xyz" "$out.own.ply"
  expect ', 1 component' "$1/example_plain_arrays" "$scratch/sphere.xyz" "$out.obj"
  for file in "$out".{ply,poisson.ply,mrf.ply,colors.ply,confidence.ply,obj}; do
    [ "$(stat -c %s "$file")" -gt 10000 ] || { echo "consumer: $file is small" >&2; exit 1; }
  done
  # No points: it ends with a message, and with no mesh.
  if "$1/example_plain_arrays" /dev/null "$out.none.obj" 2>"$scratch/error" || [ -e "$out.none.obj" ]; then
    echo "consumer: example_plain_arrays made a mesh of nothing" >&2
    exit 1
  fi
  grep -q 'invalid input' "$scratch/error"
}

# expect PATTERN COMMAND...
expect() {
  "${@:2}" >"$scratch/said" 2>"$scratch/error" || { cat "$scratch/said" "$scratch/error"; exit 1; }
  grep -q "$1" "$scratch/said" || { cat "$scratch/said"; echo "consumer: '$1' expected of ${*:2}" >&2; exit 1; }
}

# expect_missing_module PROGRAM: it fails, and says which package it lacks.
expect_missing_module() {
  if "$1" cholesky >"$scratch/said" 2>"$scratch/error" ||
    ! grep -q 'of the package libpcl-mrf-cholesky[0-9.]*, which cannot be loaded' "$scratch/said" "$scratch/error"; then
    cat "$scratch/said" "$scratch/error"
    echo "consumer: not what is expected without the module of the solver cholesky" >&2
    exit 1
  fi
}

if [ "$mode" = subdirectory ]; then
  # By a project that has not heard of PCL before, and by one that uses more of it; without a build type, and with many
  # files compiled at a time, as a parent may ask for.
  source=(-DCONSUMER_SOURCE="$tree" -DMRF_WARNINGS_AS_ERRORS=ON -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12)
  build "$scratch/build" all "${source[@]}" -DCONSUMER_EXAMPLES=OFF -DMRF_BUILD_CHOLESKY=ON
  "$scratch/build/consumer" multigrid
  "$scratch/build/consumer" cholesky
  find "$scratch/build" -name 'libpcl_mrf_cholesky*' -delete
  expect_missing_module "$scratch/build/consumer"
  rm "$scratch/build/CMakeCache.txt" # but the library is compiled
  build "$scratch/build" 'consumer example_files_to_mesh' "${source[@]}"
  sphere >"$scratch/sphere.ply"
  expect '^2000 of 2000 points, [1-9]' "$scratch/build/examples/example_files_to_mesh" "$scratch/sphere.ply" "$scratch/mesh.ply"
  exit
fi

if [ "$mode" = packages ]; then
  # Built where users build them: beside the other build directories, where ccache knows what was compiled for those.
  built=$tree/build-packages
  env -u CMAKE_CXX_COMPILER_LAUNCHER sh "$tree/cmake/packages.sh" "$built" -DMRF_WARNINGS_AS_ERRORS=ON \
    -DMRF_UNITY_BUILD="${MRF_UNITY_BUILD:-OFF}" >/dev/null
  if command -v lintian >/dev/null; then
    lintian --allow-root --fail-on error "$built"/*.deb
  fi
  for package in "$built"/*.deb; do
    dpkg-deb --extract "$package" "$scratch/root"
  done
  prefix=$scratch/root/usr
  # Only a tool that is installed finds the library without being told.
  LD_LIBRARY_PATH=$(dirname "$(find "$prefix" -name 'libpcl_mrf.so.*' -print -quit)")
  export LD_LIBRARY_PATH
else
  cmake --install "$tree" --prefix "$scratch/first" >/dev/null
  # Moved after installing: nothing in it may depend on where it was.
  mv "$scratch/first" "$scratch/prefix"
  prefix=$scratch/prefix built=$tree
fi

if grep -rIn --exclude=\*.h --exclude=\*.hpp -e "$built" -e "$scratch/first" "$prefix"; then
  echo "consumer: the installed files name the build directory" >&2
  exit 1
fi

# The same files of CMake are in both; what the examples show is shown once.
examples_too=$([ "$mode" = installed ] && echo ON || echo OFF)
build "$scratch/build" all -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release -DCONSUMER_EXAMPLES="$examples_too"
"$scratch/build/consumer" multigrid
"$scratch/build/consumer" cholesky
[ "$examples_too" = OFF ] || run_examples "$scratch/build/examples"

pkgconfig=$(dirname "$(find "$prefix" -name pcl_mrf_reconstruction.pc)")
export PKG_CONFIG_PATH=$pkgconfig
libdir=$(pkg-config --variable=libdir pcl_mrf_reconstruction)
# by_pkg_config SOURCE PROGRAM [PACKAGE...]; warnings of PCL's own headers are not ours.
by_pkg_config() {
  # shellcheck disable=SC2046,SC2086 # flags are words
  ${CXX:-g++} -std=c++17 $flags "$1" -o "$2" -Wl,-rpath,"$libdir" \
    $(pkg-config --cflags --libs pcl_mrf_reconstruction "${@:3}" | sed 's,-I/usr,-isystem /usr,g')
}
by_pkg_config "$here/consumer.cpp" "$scratch/consumer"
"$scratch/consumer" multigrid
if [ "$mode" = installed ]; then
  by_pkg_config "$examples/files_to_mesh.cpp" "$scratch/files_to_mesh" pcl_io
  expect '^2000 of 2000 points, [1-9]' "$scratch/files_to_mesh" "$scratch/sphere.ply" "$scratch/mesh.ply"
fi

# The tools find the library, and every one that was built was installed.
for tool in "$built"/bin/pcl_mrf_*; do
  [ -e "$tool" ] || continue
  "$prefix/bin/$(basename "$tool")" --help >/dev/null
done
# So does Python, where its package was built.
module=$(find "$prefix" -name '_core*.so' -printf '%h\n')
if [ -n "$module" ]; then
  expect ' triangles' env PYTHONPATH="$(dirname "$module")" PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 \
    "$here/../../apps/python/examples/numpy_to_mesh.py" "$scratch/torus.ply"
fi
# Without its module cholesky is refused, and nothing else.
rm "$(find "$prefix" -name 'libpcl_mrf_cholesky.so.*')"
expect_missing_module "$scratch/build/consumer"
"$scratch/build/consumer" multigrid
# And the module of pictures: what they say is missing is a display.
DISPLAY=:nowhere "$prefix/bin/pcl_mrf_reconstruction" none.ply none.obj --picture none.png 2>"$scratch/error" || true
grep -q "':nowhere' does not answer" "$scratch/error" || { cat "$scratch/error"; exit 1; }
# Without that of scenes, what needs it is named.
rm "$(find "$prefix" -name 'libpcl_mrf_scenes.so')"
sphere >"$scratch/sphere.ply"
"$prefix/bin/pcl_mrf_reconstruction" "$scratch/sphere.ply" "$scratch/mesh.glb" 2>"$scratch/error" || true
grep -q 'GLB, DAE and 3MF files need a module of the package' "$scratch/error" || { cat "$scratch/error"; exit 1; }
