# LCM and the code generated from lcmtypes/: C++ headers (target ignis_lcmtypes), a Python package and a Java jar for
# lcm-spy. LCM's own wheel carries library, tools and jar in one version; a system-wide LCM serves as well.

find_program(LCM_GEN lcm-gen HINTS $ENV{IGNIS_VENV}/bin REQUIRED)
execute_process(COMMAND $ENV{IGNIS_VENV}/bin/python3 -c "import lcm, os; print(os.path.dirname(os.path.dirname(lcm.__file__)))"
                OUTPUT_VARIABLE LCM_PREFIX OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp HINTS ${LCM_PREFIX}/include REQUIRED)
find_library(LCM_LIBRARY NAMES liblcm.a lcm HINTS ${LCM_PREFIX}/lib REQUIRED)
find_file(LCM_JAR lcm.jar HINTS ${LCM_PREFIX}/share/java PATH_SUFFIXES share/java)
find_library(GLIB_LIBRARY glib-2.0 REQUIRED)

add_library(lcm_imported INTERFACE)
target_include_directories(lcm_imported SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
target_link_libraries(lcm_imported INTERFACE ${LCM_LIBRARY} ${GLIB_LIBRARY} Threads::Threads)

file(GLOB LCM_TYPE_FILES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/lcmtypes/*.lcm)
set(_cpp_dir ${CMAKE_BINARY_DIR}/lcmtypes/cpp)
set(_cpp_headers)
set(_java_sources)
foreach(file IN LISTS LCM_TYPE_FILES)
  get_filename_component(type ${file} NAME_WE)
  list(APPEND _cpp_headers ${_cpp_dir}/ignis/${type}.hpp)
  list(APPEND _java_sources ${CMAKE_BINARY_DIR}/lcmtypes/java/ignis/${type}.java)
endforeach()

add_custom_command(OUTPUT ${_cpp_headers}
  COMMAND ${LCM_GEN} --cpp --cpp-std=c++11 --cpp-hpath ${_cpp_dir} ${LCM_TYPE_FILES}
  DEPENDS ${LCM_TYPE_FILES} COMMENT "Generating C++ message types" VERBATIM)
add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/python/ignis_lcm/.stamp
  COMMAND ${LCM_GEN} --python --ppath ${CMAKE_BINARY_DIR}/python/ignis_lcm ${LCM_TYPE_FILES}
  COMMAND ${CMAKE_COMMAND} -E touch ${CMAKE_BINARY_DIR}/python/ignis_lcm/.stamp
  DEPENDS ${LCM_TYPE_FILES} COMMENT "Generating Python message types" VERBATIM)
add_custom_target(lcmtypes_generated ALL DEPENDS ${_cpp_headers} ${CMAKE_BINARY_DIR}/python/ignis_lcm/.stamp)

add_library(ignis_lcmtypes INTERFACE)
target_include_directories(ignis_lcmtypes SYSTEM INTERFACE ${_cpp_dir})
target_link_libraries(ignis_lcmtypes INTERFACE lcm_imported)
add_dependencies(ignis_lcmtypes lcmtypes_generated)

find_program(JAVAC javac)
find_program(JAR jar)
if(JAVAC AND JAR AND LCM_JAR)
  set(_classes ${CMAKE_BINARY_DIR}/lcmtypes/classes)
  add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/share/ignis_types.jar
    COMMAND ${LCM_GEN} --java --jpath ${CMAKE_BINARY_DIR}/lcmtypes/java ${LCM_TYPE_FILES}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${_classes} ${CMAKE_BINARY_DIR}/share
    COMMAND ${JAVAC} -nowarn -cp ${LCM_JAR} -d ${_classes} ${_java_sources}
    COMMAND ${JAR} cf ${CMAKE_BINARY_DIR}/share/ignis_types.jar -C ${_classes} .
    DEPENDS ${LCM_TYPE_FILES} COMMENT "Building the types jar for lcm-spy" VERBATIM)
  add_custom_target(lcmtypes_jar ALL DEPENDS ${CMAKE_BINARY_DIR}/share/ignis_types.jar)
endif()
