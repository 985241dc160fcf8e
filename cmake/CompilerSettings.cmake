# SPDX-License-Identifier: BSD-3-Clause
# Settings shared by the library, the tools and the tests.
add_library(mrf_compiler_settings INTERFACE)

# No contraction of a*b+c: the same bytes on processors with and without fused multiply-add.
target_compile_options(mrf_compiler_settings INTERFACE
  -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -ffp-contract=off)
target_link_options(mrf_compiler_settings INTERFACE -Wl,--as-needed)
if(MRF_WARNINGS_AS_ERRORS)
  target_compile_options(mrf_compiler_settings INTERFACE -Werror)
endif()

if(MRF_COVERAGE)
  target_link_options(mrf_compiler_settings INTERFACE --coverage)
endif()

if(MRF_SANITIZE)
  # One version of each hot loop is enough to look at, and the class for a few types of points.
  target_compile_definitions(mrf_compiler_settings INTERFACE MRF_NO_MULTIVERSIONING PCL_ONLY_CORE_POINT_TYPES)
  target_compile_options(mrf_compiler_settings INTERFACE -fsanitize=${MRF_SANITIZE} -fno-omit-frame-pointer -g1
    $<IF:$<BOOL:$<TARGET_PROPERTY:MRF_UNOPTIMIZED>>,-O0,-O1>) # a target's that takes longer to compile than to run
  # What the sanitizers load for us they look for where a program's RPATH says: a RUNPATH is theirs alone.
  target_link_options(mrf_compiler_settings INTERFACE -fsanitize=${MRF_SANITIZE} -Wl,--disable-new-dtags)
  if(MRF_SANITIZE MATCHES "undefined")
    # Half of the compiler's time goes into checks of pointers, whose faults the address sanitizer sees or the processor
    # does not mind.
    target_compile_options(mrf_compiler_settings INTERFACE
      -fno-sanitize-recover=undefined -fno-sanitize=null,alignment,object-size,vptr)
  endif()
endif()
