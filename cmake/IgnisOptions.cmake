# Language level, warnings, sanitizers and ccache for every target of the project.
#
# No architecture flags here: a unit that sees GTSAM or PCL must share the flags of the packaged libraries, or Eigen's
# alignment differs and the program crashes.

set(CMAKE_CXX_STANDARD 23)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
# Symbols stay small: -O2 with line tables is enough for profiles and backtraces.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")

# A process loads only the libraries that it calls: l1_driver knows of GTSAM's messages, not of GTSAM.
add_link_options(LINKER:--as-needed)

option(IGNIS_WARNINGS_AS_ERRORS "Treat warnings as errors" OFF)
option(IGNIS_FUZZ "Build the fuzz targets (clang)" OFF)
set(IGNIS_SANITIZERS "" CACHE STRING "Value for -fsanitize=, for example address,undefined")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

if(IGNIS_SANITIZERS)
  add_compile_options(-fsanitize=${IGNIS_SANITIZERS} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${IGNIS_SANITIZERS})
  # The address sanitizer makes Eigen choose its own allocator, while the packaged libraries use malloc's alignment.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

add_library(ignis_warnings INTERFACE)
target_compile_options(ignis_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                       $<$<BOOL:${IGNIS_WARNINGS_AS_ERRORS}>:-Werror>)

# ignis_add_library(NAME SOURCES... [LINK PUBLIC|PRIVATE targets...]): a core library that sees src/ as include root.
function(ignis_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} ignis_warnings)
endfunction()

# ignis_optimise_loops(NAME): for libraries in which a program spends its time. They are linked into programs, where
# nothing can take the place of a function; told so, the compiler inlines them in position-independent code too. Nobody
# reads errno or the floating-point exceptions; told so, it makes a root one instruction and a choice no branch.
function(ignis_optimise_loops name)
  set(flags -O3 -fno-semantic-interposition -fno-math-errno -fno-trapping-math)
  target_compile_options(${name} PRIVATE "$<$<CONFIG:RelWithDebInfo>:${flags}>")
endfunction()

# Sanitized code takes several times as long.
set(IGNIS_TEST_LIMIT 300)
if(IGNIS_SANITIZERS)
  set(IGNIS_TEST_LIMIT 1800)
endif()

# Every test program, without the applications and benchmarks; test/sanitize reads the list.
add_custom_target(tests)
file(WRITE ${CMAKE_BINARY_DIR}/test_programs.txt "")

# ignis_add_test(NAME SOURCES... LINK targets...): a GoogleTest program; each test becomes a ctest entry with the
# program's name as label.
function(ignis_add_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/test)
  target_compile_definitions(${name} PRIVATE IGNIS_TEST_DATA="${CMAKE_SOURCE_DIR}/test/data"
                             IGNIS_CONFIG_DIR="${CMAKE_SOURCE_DIR}/config")
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest_main ignis_warnings)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${IGNIS_TEST_LIMIT} LABELS ${name})
  add_dependencies(tests ${name})
  file(APPEND ${CMAKE_BINARY_DIR}/test_programs.txt "${name}\n")
endfunction()
