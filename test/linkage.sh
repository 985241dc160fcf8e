#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What the built library shows to its users, and what it and the tools need. Run by ctest.
#   linkage.sh LIBRARY HEADERS MODULE CONFIGURATION [TOOL...]
# MODULE: of the solver cholesky, or none; CONFIGURATION: Debug is not asked how loops are compiled; TOOL: one that is to
# be free of CGAL
set -euo pipefail

library=$1 headers=$2 module=$3 configuration=$4
tools=("${@:5}")
failed=0
fail() {
  echo "linkage: $*" >&2
  failed=1
}

# Every name that is shown is declared in a public header. Names without parameters and template arguments.
shown=$(nm -DC --defined-only "$library" | cut -d' ' -f3- |
  sed -E 's/^(typeinfo name for|typeinfo for|vtable for|void) //; s/->/ /g; s/\[abi:[a-z0-9]+\]//g; :a; s/<[^<>]*>//g; ta; s/\(.*//; s/~//; s/^.* (pcl::)/\1/' |
  sort -u)
declared=$(find "$headers" -type f -exec sed 's,//.*,,' {} + | grep -oE '[A-Za-z_][A-Za-z0-9_]*' | sort -u)
foreign=$(grep -vE '^pcl::(mrf::|MRFReconstruction::|MRFReconstruction$)' <<<"$shown" || true)
[ -z "$foreign" ] || fail "shown, and not of the library:" $foreign
undeclared=$(comm -23 <(sed 's/::/\n/g' <<<"$shown" | sort -u) - <<<"$declared")
[ -z "$undeclared" ] || fail "shown, and declared in no public header:" $undeclared
for name in pcl::mrf::reconstruct pcl::mrf::InvalidOption pcl::MRFReconstruction::reconstruct; do
  grep -qx "$name" <<<"$shown" || fail "$name is hidden"
done

needed() { objdump -p "$1" | sed -n 's/^ *NEEDED *//p'; }

# BSD, or the compiler's run time: what is under the GPL would bind every program that links to the library.
for other in $(needed "$library"); do
  case $other in
  libpcl_common.so* | libpcl_kdtree.so* | libpcl_search.so*) ;;
  libpcl_features.so*) # .03 s of every start: where there is OpenMP, PCL's normals are compiled in
    ! needed "$library" | grep -q libgomp || fail "$library needs $other" ;;
  libboost_serialization.so*) ;;
  libstdc++.so* | libc++.so* | libm.so* | libgcc_s.so* | libc.so* | libdl.so* | libgomp.so* | ld-linux*) ;;
  *) fail "$library needs $other" ;;
  esac
done
if ldd "$library" | grep -iE 'cholmod|suitesparse|cgal|gmp|mpfr|vtk|libmpi'; then
  fail "$library loads these"
fi

# A loop of several versions whose body is a function of its own runs that one of the baseline: 4 % of a clean scan.
if [ "$configuration" != Debug ] && slow=$(nm -C "$library" | grep 'Baseline(.*lambda'); then
  fail "compiled without the instructions of its caller: $slow"
fi

# What is under the GPL is here, and shows nothing but its one function.
if [ "$module" != none ]; then
  needed "$module" | grep -q '^libcholmod.so' || fail "$module does not need CHOLMOD"
  [ "$(nm -D --defined-only "$module" | cut -d' ' -f3)" = pcl_mrf_cholesky_1 ] || fail "$module shows other names"
fi

for tool in "${tools[@]}"; do
  needed "$tool" | grep -q libpcl_mrf.so || fail "$tool has the library inside, which is to be shared"
  if ldd "$tool" | grep -iE 'cholmod|gmp|mpfr' || nm -C "$tool" | grep 'CGAL::'; then
    fail "$tool is built with CGAL, and so under the GPL"
  fi
done

echo "linkage: $(wc -l <<<"$shown") names are shown"
exit "$failed"
