#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests: the optimised build with warnings as errors, then the tests of
# the stages under the address, undefined-behaviour and thread sanitizers.
#   bash test/run.sh              everything
#   bash test/run.sh release      only the optimised build
set -euo pipefail

cd "$(dirname "$0")/.."
what=${1:-all}
case $what in all | release) ;; *)
  echo "usage: bash test/run.sh [all|release]" >&2
  exit 2
  ;;
esac

sh cmake/install_packages.sh
# The tests' clocks and seeds do not depend on these; what they print does.
export LC_ALL=C

# build DIRECTORY [CMAKE OPTIONS...]: configures and builds; the output is shown only if that fails.
build() {
  local directory=$1 start=$SECONDS
  shift
  mkdir -p "$directory"
  if ! { cmake -S . -B "$directory" -G Ninja -DMRF_WARNINGS_AS_ERRORS=ON "$@" && cmake --build "$directory"; } \
    >"$directory/build.log" 2>&1; then
    grep -E -A12 'error|Error|FAILED' "$directory/build.log" | head -n 200
    echo "run.sh: $directory failed to build; all of the output is in $directory/build.log" >&2
    return 1
  fi
  echo "== built $directory in $((SECONDS - start)) s"
}

# run DIRECTORY [CTEST OPTIONS...]
run() {
  (cd "$1" && ctest --output-on-failure -j2 "${@:2}")
}

build build
run build
[ "$what" = all ] || exit 0

export UBSAN_OPTIONS=print_stacktrace=1
export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1
export LSAN_OPTIONS=suppressions=$PWD/test/support/lsan.supp:print_suppressions=0
build build-sanitize -DCMAKE_BUILD_TYPE=Sanitize -DMRF_SANITIZE=address,undefined -DMRF_BUILD_APPS=OFF
run build-sanitize

export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1
build build-thread -DCMAKE_BUILD_TYPE=Sanitize -DMRF_SANITIZE=thread -DMRF_BUILD_APPS=OFF
run build-thread -L parallel

echo "== all tests passed in $((SECONDS / 60)) min $((SECONDS % 60)) s"
