#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds with warnings as errors, and runs all tests: the optimized build, then the tests of the
# stages under the address, undefined-behavior and thread sanitizers.
#   bash test/run.sh              everything
#   bash test/run.sh release      only the optimized build
#   bash test/run.sh sanitize     only the sanitizers
#   bash test/run.sh clang        not in everything: clang compiles the library and the tests' support, each file by itself
set -euo pipefail

cd "$(dirname "$0")/.."
what=${1:-all}
case $what in all | release | sanitize | clang) ;; *)
  echo "usage: bash test/run.sh [all|release|sanitize|clang]" >&2
  exit 2
  ;;
esac

if [ "$what" = clang ]; then
  sh cmake/install_packages.sh clang
else
  sh cmake/install_packages.sh
fi
# The tests' clocks and seeds do not depend on these; what they print does.
export LC_ALL=C

# build DIRECTORY TARGETS [CMAKE OPTIONS...]: configures and builds; the output is shown only if that fails.
build() {
  local directory=$1 targets=$2 start=$SECONDS
  shift 2
  mkdir -p "$directory"
  # shellcheck disable=SC2086 # targets are words
  if ! { cmake -S . -B "$directory" -G Ninja -DMRF_WARNINGS_AS_ERRORS=ON "$@" && cmake --build "$directory" --target $targets; } \
    >"$directory/build.log" 2>&1; then
    grep -E -A12 'error|Error|FAILED' "$directory/build.log" | head -n 200
    echo "run.sh: $directory failed to build; all of the output is in $directory/build.log" >&2
    return 1
  fi
  echo "== built $directory in $((SECONDS - start)) s"
}

# run DIRECTORY [CTEST OPTIONS...], behind the command in $prefix
prefix=
run() {
  (cd "$1" && $prefix ctest --output-on-failure --no-tests=error -j2 "${@:2}")
}

if [ "$what" = clang ]; then
  # Without precompiled headers, a file that leaves out an include of its own does not compile.
  build build-clang 'pcl_mrf mrf_test_support mrf_test_systems mrf_test_scans' -DCMAKE_CXX_COMPILER=clang++ \
    -DCMAKE_BUILD_TYPE=Debug -DMRF_BUILD_APPS=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
  exit
fi

if [ "$what" != sanitize ]; then
  build build all -DMRF_UNITY_BUILD=ON
  run build
fi
[ "$what" != release ] || exit 0

export UBSAN_OPTIONS=print_stacktrace=1
export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1
build build-sanitize all -DCMAKE_BUILD_TYPE=Debug -DMRF_SANITIZE=address,undefined -DMRF_BUILD_APPS=OFF
run build-sanitize

export TSAN_OPTIONS="halt_on_error=1:second_deadlock_stack=1:suppressions='$PWD/test/support/tsan.supp'"
# It does not see where OpenMP's threads, of PCL's normals in the preset paper, wait for each other: one has nobody to wait for.
export OMP_THREAD_LIMIT=1
# Eigen's assertions are checked above.
build build-thread parallel_tests -DCMAKE_BUILD_TYPE=Release -DMRF_SANITIZE=thread -DMRF_BUILD_APPS=OFF
# GCC 12's run time cannot map its shadow memory where the kernel randomizes more than 28 bits of the address.
if [ "$(cat /proc/sys/vm/mmap_rnd_bits 2>/dev/null || echo 0)" -gt 28 ]; then
  prefix='setarch --addr-no-randomize'
fi
run build-thread -L parallel

echo "== all tests passed in $((SECONDS / 60)) min $((SECONDS % 60)) s"
