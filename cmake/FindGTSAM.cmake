# Imported target GTSAM::gtsam.
#
# Debian 13's package config names a libCppUnitLite.a that no package ships, so it fails as soon as it is read. Where
# that library is there, the upstream config works and is used; otherwise the target is made from header and library. TBB
# belongs on the link line: the packaged library was built with it, and headers instantiate calls into it.

if(TARGET GTSAM::gtsam)
  return()
endif()

find_library(GTSAM_CPPUNITLITE_LIBRARY CppUnitLite)
mark_as_advanced(GTSAM_CPPUNITLITE_LIBRARY)
if(GTSAM_CPPUNITLITE_LIBRARY)
  find_package(GTSAM CONFIG QUIET)
  if(TARGET gtsam)
    add_library(GTSAM::gtsam INTERFACE IMPORTED)
    target_link_libraries(GTSAM::gtsam INTERFACE gtsam)
    return()
  endif()
endif()

find_path(GTSAM_INCLUDE_DIR gtsam/config.h)
find_library(GTSAM_LIBRARY gtsam)
find_package(TBB QUIET)
if(GTSAM_INCLUDE_DIR)
  file(STRINGS ${GTSAM_INCLUDE_DIR}/gtsam/config.h _version_line REGEX "define GTSAM_VERSION_NUMERIC")
  string(REGEX MATCH "[0-9]+" GTSAM_VERSION "${_version_line}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(GTSAM REQUIRED_VARS GTSAM_LIBRARY GTSAM_INCLUDE_DIR TBB_FOUND
                                  VERSION_VAR GTSAM_VERSION)

if(GTSAM_FOUND)
  add_library(GTSAM::gtsam UNKNOWN IMPORTED)
  set_target_properties(GTSAM::gtsam PROPERTIES IMPORTED_LOCATION ${GTSAM_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${GTSAM_INCLUDE_DIR})
  target_link_libraries(GTSAM::gtsam INTERFACE TBB::tbb Eigen3::Eigen)
endif()
