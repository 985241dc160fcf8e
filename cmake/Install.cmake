# SPDX-License-Identifier: BSD-3-Clause
# Installs library, headers, tools, the CMake package and the pkg-config file, as components: library, development, tools,
# experiments and python, which are Python, mpi, which needs MPI, and what is under the GPL: cholesky by CHOLMOD, evaluation by
# the CGAL packages in its tool.
include(CMakePackageConfigHelpers)

set(MRF_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/pcl_mrf_reconstruction)

install(TARGETS pcl_mrf EXPORT pcl_mrf_reconstruction
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT library)
foreach(module cholesky mpi) # where the library finds them: beside itself
  if(TARGET mrf_${module})
    install(TARGETS mrf_${module} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${module})
  endif()
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
# The tools find the library beside them, wherever the tree is moved; in the system's own place it is found anyway.
file(RELATIVE_PATH MRF_LIBRARY_FROM_TOOL ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
function(mrf_install_tool tool component)
  if(TARGET ${tool})
    if(NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
      set_target_properties(${tool} PROPERTIES INSTALL_RPATH "$ORIGIN/${MRF_LIBRARY_FROM_TOOL}")
    endif()
    install(TARGETS ${tool} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
  endif()
endfunction()
mrf_install_tool(pcl_mrf_reconstruction tools)
mrf_install_tool(pcl_mrf_scan tools)
mrf_install_tool(pcl_mrf_evaluate evaluation)
if(TARGET mrf_pictures) # where the tools find the library
  install(TARGETS mrf_pictures mrf_scenes LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT tools)
endif()

# What a static library leaves to its users to link; a shared one has it inside.
get_target_property(MRF_LIBRARY_TYPE pcl_mrf TYPE)
set(MRF_IS_STATIC OFF)
set(MRF_PKG_CONFIG_LIBS)
if(MRF_LIBRARY_TYPE STREQUAL "STATIC_LIBRARY")
  set(MRF_IS_STATIC ON)
  string(APPEND MRF_PKG_CONFIG_LIBS " -pthread")
  foreach(library boost_serialization ${CMAKE_DL_LIBS})
    string(APPEND MRF_PKG_CONFIG_LIBS " -l${library}")
  endforeach()
endif()

install(EXPORT pcl_mrf_reconstruction NAMESPACE pcl_mrf:: DESTINATION ${MRF_CMAKE_DIR} COMPONENT development
  FILE pcl_mrf_reconstructionTargets.cmake)
configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/pcl_mrf_reconstructionConfig.cmake.in
  ${PROJECT_BINARY_DIR}/pcl_mrf_reconstructionConfig.cmake
  INSTALL_DESTINATION ${MRF_CMAKE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pcl_mrf_reconstructionConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/pcl_mrf_reconstructionConfig.cmake
  ${PROJECT_BINARY_DIR}/pcl_mrf_reconstructionConfigVersion.cmake
  DESTINATION ${MRF_CMAKE_DIR} COMPONENT development)

# Relative to the file where the directories are relative, so that the installed tree can be moved.
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(MRF_PKG_CONFIG_PREFIX ${CMAKE_INSTALL_PREFIX})
  set(MRF_PKG_CONFIG_LIBDIR ${CMAKE_INSTALL_LIBDIR})
else()
  file(RELATIVE_PATH MRF_PREFIX_FROM_PKG_CONFIG
    ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
  string(REGEX REPLACE "/$" "" MRF_PREFIX_FROM_PKG_CONFIG ${MRF_PREFIX_FROM_PKG_CONFIG})
  set(MRF_PKG_CONFIG_PREFIX "\${pcfiledir}/${MRF_PREFIX_FROM_PKG_CONFIG}")
  set(MRF_PKG_CONFIG_LIBDIR "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
endif()
if(IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(MRF_PKG_CONFIG_INCLUDEDIR ${CMAKE_INSTALL_INCLUDEDIR})
else()
  set(MRF_PKG_CONFIG_INCLUDEDIR "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(${PROJECT_SOURCE_DIR}/cmake/pcl_mrf_reconstruction.pc.in
  ${PROJECT_BINARY_DIR}/pcl_mrf_reconstruction.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/pcl_mrf_reconstruction.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
  COMPONENT development)
