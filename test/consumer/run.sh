#!/usr/bin/env bash
# Builds and runs the consumer. Run by ctest with the compiler in CXX.
#   run.sh installed BUILD SCRATCH      installs BUILD and consumes it by find_package and by pkg-config
#   run.sh subdirectory SOURCE SCRATCH  consumes SOURCE as a subdirectory, static and without CHOLMOD
set -euo pipefail

mode=$1 tree=$2 scratch=$3
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$scratch"
mkdir -p "$scratch"

# The library is to be found by what was installed, not by what the caller's shell has set.
unset LD_LIBRARY_PATH CMAKE_PREFIX_PATH PKG_CONFIG_PATH

configure() { cmake -S "$here" -B "$1" -G Ninja --log-level=WARNING "${@:2}" >/dev/null; }

if [ "$mode" = subdirectory ]; then
  configure "$scratch/build" -DCONSUMER_SOURCE="$tree" -DMRF_WITH_CHOLMOD=OFF
  cmake --build "$scratch/build" >"$scratch/log" || { cat "$scratch/log"; exit 1; }
  "$scratch/build/consumer" multigrid
  "$scratch/build/consumer" cholesky
  exit
fi

cmake --install "$tree" --prefix "$scratch/first" >/dev/null
# Moved after installing: nothing in it may depend on where it was.
mv "$scratch/first" "$scratch/prefix"
prefix=$scratch/prefix

if grep -rIn --exclude=\*.h --exclude=\*.hpp -e "$tree" -e "$scratch/first" "$prefix"; then
  echo "consumer: the installed files name the build directory" >&2
  exit 1
fi

configure "$scratch/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release
cmake --build "$scratch/build" >"$scratch/log" || { cat "$scratch/log"; exit 1; }
"$scratch/build/consumer" multigrid
"$scratch/build/consumer" cholesky

pkgconfig=$(dirname "$(find "$prefix" -name pcl_mrf_reconstruction.pc)")
export PKG_CONFIG_PATH=$pkgconfig
libdir=$(pkg-config --variable=libdir pcl_mrf_reconstruction)
# shellcheck disable=SC2046 # flags are words
${CXX:-g++} -std=c++17 -O1 "$here/consumer.cpp" -o "$scratch/consumer" \
  $(pkg-config --cflags --libs pcl_mrf_reconstruction) -Wl,-rpath,"$libdir"
"$scratch/consumer" multigrid

# The tools find the library by themselves, and every one that was built was installed.
for tool in "$tree"/bin/pcl_mrf_*; do
  [ -e "$tool" ] || continue
  "$prefix/bin/$(basename "$tool")" --help >/dev/null
done
