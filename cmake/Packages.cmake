# SPDX-License-Identifier: BSD-3-Clause
# The target package: Debian packages of the components; see packages.sh, which configures for it.
if(NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr" OR NOT BUILD_SHARED_LIBS OR NOT MRF_BUILD_APPS OR NOT MRF_BUILD_CHOLESKY
   OR NOT MRF_BUILD_MPI)
  return() # the packages are of a build whose files belong there
endif()

set(MRF_PACKAGE_CONTACT "The authors of pcl_mrf_reconstruction <pcl-mrf-reconstruction@users.noreply.github.com>" CACHE STRING
  "Maintainer of the Debian packages: name <address>")
set(MRF_PACKAGE_library libpcl-mrf${MRF_SONAME})
set(MRF_PACKAGE_development libpcl-mrf-dev)
set(MRF_PACKAGE_tools pcl-mrf-tools)
set(MRF_PACKAGE_evaluation pcl-mrf-evaluation)
set(MRF_PACKAGE_experiments pcl-mrf-experiments)
set(MRF_PACKAGE_python python3-pcl-mrf)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME pcl-mrf-reconstruction)
set(CPACK_PACKAGE_CONTACT ${MRF_PACKAGE_CONTACT})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Surface reconstruction from scanned points")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS # whatever the umask says
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL library cholesky mpi development tools evaluation experiments)
if(MRF_BUILD_PYTHON) # whose module is of one version of Python
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR MRF_NEXT_PYTHON "${Python3_VERSION_MINOR} + 1")
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(WRITE ${PROJECT_BINARY_DIR}/packages/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/packages/triggers)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_COMPONENT_TOOLS_DEPENDS library)
set(CPACK_COMPONENT_EVALUATION_DEPENDS library tools) # which have the module of pictures
set(CPACK_COMPONENT_EXPERIMENTS_DEPENDS tools evaluation)
set(CPACK_COMPONENT_PYTHON_DEPENDS library)

set(MRF_IS_WHAT "Reconstructs surfaces from scanned points by regularizing a signed distance
field with a Markov random field (Paulsen, Baerentzen, Larsen 2010).")
set(MRF_DESCRIPTION_library "This package has the shared library.")
set(MRF_DESCRIPTION_cholesky "This package has CHOLMOD for the solver cholesky, which the library loads when it
is asked for. It is under the GPL, which the library is not.")
set(MRF_DESCRIPTION_mpi "This package has message passing by MPI, which the library loads where mpirun has
started several processes.")
set(MRF_DESCRIPTION_development "This package has headers, a CMake package and a pkg-config file.")
set(MRF_DESCRIPTION_tools "This package has the programs that reconstruct a scan and that simulate one.")
set(MRF_DESCRIPTION_evaluation "This package has the program that measures meshes. It is built with CGAL, and so
under the GPL.")
set(MRF_DESCRIPTION_experiments "This package has the experiments of the paper, in Python.")
set(MRF_DESCRIPTION_python "This package has the module pcl_mrf for Python and numpy.")
set(MRF_SECTION_library libs)
set(MRF_SECTION_cholesky libs)
set(MRF_SECTION_mpi libs)
set(MRF_SECTION_development libdevel)
set(MRF_SECTION_tools graphics)
set(MRF_SECTION_evaluation graphics)
set(MRF_SECTION_experiments graphics)
set(MRF_SECTION_python python)
# With the reference BLAS it takes twelve times as long.
set(CPACK_DEBIAN_CHOLESKY_PACKAGE_DEPENDS libopenblas0)
set(CPACK_DEBIAN_CHOLESKY_PACKAGE_ENHANCES ${MRF_PACKAGE_library})
set(CPACK_DEBIAN_MPI_PACKAGE_ENHANCES ${MRF_PACKAGE_library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS "${MRF_PACKAGE_cholesky}, ${MRF_PACKAGE_mpi}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "${MRF_PACKAGE_library} (= ${PROJECT_VERSION}), libpcl-dev, libeigen3-dev")
set(CPACK_DEBIAN_EXPERIMENTS_PACKAGE_DEPENDS "python3, python3-numpy, python3-scipy, python3-matplotlib, python3-vtk9")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
  "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${MRF_NEXT_PYTHON}), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, python3-open3d")
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "xvfb, xauth") # pictures without a display, by xvfb-run
set(CPACK_DEBIAN_EXPERIMENTS_PACKAGE_SUGGESTS "pcl-tools, glmark2-data")

string(TIMESTAMP MRF_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC) # of SOURCE_DATE_EPOCH, if that is set
configure_file(${PROJECT_SOURCE_DIR}/cmake/debian_changelog.in ${PROJECT_BINARY_DIR}/packages/changelog @ONLY)
execute_process(COMMAND gzip -9nf ${PROJECT_BINARY_DIR}/packages/changelog COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PROJECT_SOURCE_DIR}/LICENSE MRF_LICENSE)
string(REGEX REPLACE "\n---.*" "" MRF_LICENSE "${MRF_LICENSE}") # our own; what is under the GPL is said below
foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${MRF_PACKAGE_${component}})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${MRF_SECTION_${component}})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${MRF_IS_WHAT}\n\n${MRF_DESCRIPTION_${component}}")
  set(MRF_COPYRIGHT_OF_PROGRAMS)
  if(component STREQUAL "evaluation")
    set(MRF_COPYRIGHT_OF_PROGRAMS "The program in this package is under the GPL, version 3 or later, by the CGAL packages in it; its text\nis in /usr/share/common-licenses/GPL-3.\n\n")
  elseif(component STREQUAL "cholesky")
    set(MRF_COPYRIGHT_OF_PROGRAMS "The module in this package is under the GPL, version 2 or later, by the parts of CHOLMOD that it loads; its\ntext is in /usr/share/common-licenses/GPL-2.\n\n")
  endif()
  configure_file(${PROJECT_SOURCE_DIR}/cmake/debian_copyright.in
    ${PROJECT_BINARY_DIR}/packages/${component}/copyright @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/packages/${component}/copyright ${PROJECT_BINARY_DIR}/packages/changelog.gz
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${MRF_PACKAGE_${component}} COMPONENT ${component})
endforeach()
include(CPack)
