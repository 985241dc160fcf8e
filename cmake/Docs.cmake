# SPDX-License-Identifier: BSD-3-Clause
# The target docs: the API reference of the public headers, as HTML in docs/ of the build directory.
find_package(Doxygen QUIET)
if(DOXYGEN_FOUND)
  set(DOXYGEN_PROJECT_NAME pcl_mrf_reconstruction)
  set(DOXYGEN_PROJECT_BRIEF ${PROJECT_DESCRIPTION})
  set(DOXYGEN_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/docs)
  set(DOXYGEN_STRIP_FROM_PATH ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR})
  set(DOXYGEN_STRIP_FROM_INC_PATH ${PROJECT_SOURCE_DIR}/include)
  set(DOXYGEN_USE_MDFILE_AS_MAINPAGE ${PROJECT_SOURCE_DIR}/README.md)
  set(DOXYGEN_IMAGE_PATH ${PROJECT_SOURCE_DIR}/apps/pictures)
  set(DOXYGEN_EXAMPLE_PATH ${PROJECT_SOURCE_DIR}/apps/examples)
  set(DOXYGEN_EXCLUDE_PATTERNS */impl/*)
  set(DOXYGEN_PREDEFINED PCL_MRF_EXPORT=)
  set(DOXYGEN_MACRO_EXPANSION YES)
  set(DOXYGEN_EXPAND_ONLY_PREDEF YES)
  # A docstring's first sentence is its summary; members whose name says all have none.
  set(DOXYGEN_JAVADOC_AUTOBRIEF YES)
  set(DOXYGEN_EXTRACT_ALL YES)
  set(DOXYGEN_SORT_MEMBER_DOCS NO)
  set(DOXYGEN_GENERATE_LATEX NO)
  set(DOXYGEN_QUIET YES)
  set(DOXYGEN_WARN_IF_INCOMPLETE_DOC NO)
  set(DOXYGEN_WARN_AS_ERROR FAIL_ON_WARNINGS)
  # The README's links lead to pages of the reference as well.
  set(pages README.md src/README.md apps/README.md apps/experiments/README.md test/benchmark/README.md .github/CONTRIBUTING.md
      .github/CHANGELOG.md)
  list(TRANSFORM pages PREPEND ${PROJECT_SOURCE_DIR}/)
  doxygen_add_docs(docs ${PROJECT_SOURCE_DIR}/include ${pages}
    COMMENT "API reference in ${DOXYGEN_OUTPUT_DIRECTORY}/html/index.html")
endif()
