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

if(MRF_SANITIZE)
  # One version of each hot loop is enough to look at.
  target_compile_definitions(mrf_compiler_settings INTERFACE MRF_NO_MULTIVERSIONING)
  target_compile_options(mrf_compiler_settings INTERFACE -fsanitize=${MRF_SANITIZE} -fno-omit-frame-pointer -O1 -g1)
  target_link_options(mrf_compiler_settings INTERFACE -fsanitize=${MRF_SANITIZE})
  if(MRF_SANITIZE MATCHES "undefined")
    target_compile_options(mrf_compiler_settings INTERFACE -fno-sanitize-recover=undefined)
  endif()
endif()
