# How every target of the project is made: one place for warnings, include root and test registration.

add_library(vergence_options INTERFACE)
target_include_directories(vergence_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(vergence_options INTERFACE -Wall -Wextra -Wconversion -Wshadow -Werror)
# The same bits on every machine: no fused multiply-add behind our back on targets that have it.
target_compile_options(vergence_options INTERFACE -ffp-contract=off)
# Vectors of the Scalable Vector Extension are no C++ objects (no arrays, no members): such machines run the NEON kernels.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  target_compile_definitions(vergence_options INTERFACE "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
# ARMv7's NEON has no doubles, which half of the kernels are made of: portable code throughout. And a file would end at 2 GiB: the
# readings of a day or two.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "armv7")
  target_compile_definitions(vergence_options INTERFACE HWY_DISABLED_TARGETS=HWY_NEON _FILE_OFFSET_BITS=64)
endif()
if(VERGENCE_SANITIZE)
  target_compile_options(vergence_options INTERFACE -fsanitize=${VERGENCE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(vergence_options INTERFACE -fsanitize=${VERGENCE_SANITIZE})
endif()

# What most files read.
set(VERGENCE_COMMON_HEADERS
  <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU>
  <algorithm> <array> <atomic> <charconv> <chrono> <cmath> <condition_variable> <filesystem> <fstream> <functional> <map> <memory>
  <mutex> <optional> <random> <span> <sstream> <string> <string_view> <thread> <unordered_map> <variant> <vector>
  <fmt/format.h> <nlohmann/json.hpp>)

# vergence_precompile(NAME PACKAGES targets… HEADERS <a> …): headers in a form that is read fast.
function(vergence_precompile name)
  cmake_parse_arguments(ARG "" "" "PACKAGES;HEADERS" ${ARGN})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE vergence_options ${ARG_PACKAGES})
  target_compile_options(${name} PRIVATE ${VERGENCE_PRECOMPILED_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  set_property(GLOBAL PROPERTY ${name}_PACKAGES ${ARG_PACKAGES})
endfunction()

# What precompiled headers and what is compiled with them have to share. Memory that the compiler's garbage collector leaves alone is a tenth
# of the time; ccache asks for the last one.
set(VERGENCE_PRECOMPILED_OPTIONS -pthread $<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=524288;-fpch-preprocess>)

# vergence_read_precompiled(NAME HEADERS SOURCES…): the target's files read HEADERS, of vergence_precompile(), where there are such.
function(vergence_read_precompiled name headers)
  if(NOT TARGET ${headers}) # firmware_iface stands alone
    return()
  endif()
  foreach(source IN LISTS ARGN)
    if(source MATCHES "\\.c$")
      set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
    endif()
  endforeach()
  # The compiler refuses precompiled headers where other macros are defined than when they were made.
  get_property(packages GLOBAL PROPERTY ${headers}_PACKAGES)
  target_link_libraries(${name} PRIVATE ${packages})
  target_compile_options(${name} PRIVATE ${VERGENCE_PRECOMPILED_OPTIONS})
  target_precompile_headers(${name} REUSE_FROM ${headers})
endfunction()

# vergence_unite(NAME SOURCES…): the target's files are compiled together where they can be. Reading headers and making their templates is most
# of what a file costs to compile: several files at once do it once.
function(vergence_unite name)
  set(united)
  foreach(source IN LISTS ARGN)
    if(source MATCHES "\\.cpp$" AND NOT IS_ABSOLUTE ${source})
      list(APPEND united ${source})
    endif()
  endforeach()
  if(NOT united)
    return()
  endif()
  execute_process(COMMAND ${VERGENCE_PYTHON} -I -S ${PROJECT_SOURCE_DIR}/scripts/cmake/united_files.py ${CMAKE_CURRENT_SOURCE_DIR} ${united}
    OUTPUT_VARIABLE groups COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "|" groups "${groups}")
  string(REGEX MATCHALL "[^\n]+" groups "${groups}")
  set(number 0)
  foreach(group IN LISTS groups)
    math(EXPR number "${number} + 1")
    string(REPLACE "|" ";" group "${group}")
    set_source_files_properties(${group} PROPERTIES UNITY_GROUP ${number})
  endforeach()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# vergence_library(NAME SOURCES a.cpp b.cpp [DEPENDS targets…]): the library of one room.
# Without sources it is a header-only room. With VERGENCE_UNITY its files are compiled together where they can be.
function(vergence_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC vergence_options ${ARG_DEPENDS})
    vergence_read_precompiled(${name} vergence_headers ${ARG_SOURCES})
    if(VERGENCE_UNITY)
      vergence_unite(${name} ${ARG_SOURCES})
    endif()
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE vergence_options ${ARG_DEPENDS})
  endif()
endfunction()

# A test's own files are compiled less optimised than the product: what takes time is in the libraries. Under sanitizers they are not
# optimised at all, as that takes as long again as compiling them.
# The names of sanitizers have commas, which a generator expression would take for its own.
if(VERGENCE_SANITIZE)
  set(VERGENCE_TEST_OPTIMISATION -O0)
else()
  set(VERGENCE_TEST_OPTIMISATION -O1)
endif()

# The tiers of tests (CONTRIBUTING.md); every test is in exactly one of them, which is one of its labels. Building tests_TIER builds what the
# tests of a tier run; `all` builds none of them.
set(VERGENCE_TIERS default rig statistics hardening deploy)
if(VERGENCE_TESTS)
  foreach(tier IN LISTS VERGENCE_TIERS)
    add_custom_target(tests_${tier})
  endforeach()
endif()

# vergence_labels(VARIABLE TIER): the labels of a test of this folder: its tier, and the folder below tests/ (core/bundle, system/run), by which
# `scripts/test -L core/bundle` runs the tests of one folder.
function(vergence_labels variable tier)
  if(NOT tier IN_LIST VERGENCE_TIERS)
    message(FATAL_ERROR "tests: ${tier} is not a tier; the tiers are ${VERGENCE_TIERS}")
  endif()
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR}/tests ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "^unit/" "" folder ${folder})
  string(REGEX REPLACE "^([^/]+/[^/]+)/.*" "\\1" folder ${folder})
  set(${variable} ${tier} ${folder} PARENT_SCOPE)
endfunction()

# vergence_test_program(NAME TIER SOURCES … [DEPENDS …] [PROGRAM]): an executable of tests in build/tests, built with its tier. PROGRAM: it runs
# the built program, whose path it finds in the macro VERGENCE_PROGRAM.
function(vergence_test_program name tier)
  cmake_parse_arguments(ARG "PROGRAM;WORKS" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE vergence_options ${ARG_DEPENDS})
  if(VERGENCE_SANITIZE AND ARG_WORKS)
    vergence_read_precompiled(${name} vergence_headers ${ARG_SOURCES})
  else()
    vergence_read_precompiled(${name} vergence_test_headers ${ARG_SOURCES})
    target_compile_options(${name} PRIVATE ${VERGENCE_TEST_OPTIMISATION})
  endif()
  if(VERGENCE_UNITY)
    vergence_unite(${name} ${ARG_SOURCES})
  endif()
  if(ARG_PROGRAM)
    target_compile_definitions(${name} PRIVATE VERGENCE_PROGRAM="$<TARGET_FILE:vergence>")
    add_dependencies(${name} vergence)
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  add_dependencies(tests_${tier} ${name})
endfunction()

# vergence_test(NAME SOURCES … [DEPENDS …] [TIER tier] [TIMEOUT s] [COST s] [SERIAL] [SHARDS n] [WORKS] [PROGRAM] [DEFINITIONS …]): one GoogleTest
# program, one ctest a case. TIER: `default` if not given. SERIAL: its tests run alone (image rate, timing of threads). SHARDS: n ctests named
# NAME.1_of_n and so on instead, for cases that share what takes long to make. COST: the seconds that each ctest takes, which order the tests
# and divide a tier into shares. WORKS: its own files do the work (images rendered, sequences made) and are optimised like the product.
function(vergence_test name)
  cmake_parse_arguments(ARG "SERIAL;WORKS;PROGRAM" "TIER;TIMEOUT;COST;SHARDS" "SOURCES;DEPENDS;DEFINITIONS" ${ARGN})
  if(NOT ARG_TIER)
    set(ARG_TIER default)
  endif()
  set(options)
  foreach(option PROGRAM WORKS)
    if(ARG_${option})
      list(APPEND options ${option})
    endif()
  endforeach()
  vergence_test_program(${name} ${ARG_TIER} SOURCES ${ARG_SOURCES} DEPENDS ${ARG_DEPENDS} GTest::gtest GTest::gtest_main ${options})
  target_compile_definitions(${name} PRIVATE ${ARG_DEFINITIONS})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(CMAKE_CROSSCOMPILING OR VERGENCE_SANITIZE) # an emulator, or a sanitizer beside another test, takes some ten times as long
    math(EXPR ARG_TIMEOUT "5 * ${ARG_TIMEOUT}")
  endif()
  vergence_labels(labels ${ARG_TIER})
  set(properties TIMEOUT ${ARG_TIMEOUT})
  if(ARG_COST)
    list(APPEND properties COST ${ARG_COST})
  endif()
  if(ARG_SERIAL)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  if(ARG_SHARDS)
    foreach(shard RANGE 1 ${ARG_SHARDS})
      math(EXPR index "${shard} - 1")
      add_test(NAME ${name}.${shard}_of_${ARG_SHARDS} COMMAND ${name} --gtest_brief=1)
      set_tests_properties(${name}.${shard}_of_${ARG_SHARDS} PROPERTIES ${properties} LABELS "${labels}"
        ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
    endforeach()
    return()
  endif()
  # gtest_discover_tests() takes one label at a time. Parameters that print as bytes would make a name of addresses.
  list(TRANSFORM labels PREPEND "LABELS;")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES PROPERTIES ${properties} ${labels})
endfunction()

# vergence_command_test(NAME name TIER tier COMMAND … [PROPERTIES …]): a ctest that runs a command, and what builds the targets in it.
function(vergence_command_test)
  cmake_parse_arguments(ARG "" "NAME;TIER" "COMMAND;PROPERTIES" ${ARGN})
  add_test(NAME ${ARG_NAME} COMMAND ${ARG_COMMAND})
  list(GET ARG_COMMAND 0 program)
  foreach(word IN ITEMS "$<TARGET_FILE:${program}>" LISTS ARG_COMMAND)
    if(word MATCHES "<TARGET_FILE:(.*)>$")
      set(target "${CMAKE_MATCH_1}")
      if(TARGET "${target}" AND NOT target MATCHES "::")
        add_dependencies(tests_${ARG_TIER} "${target}")
      endif()
    endif()
  endforeach()
  vergence_labels(labels ${ARG_TIER})
  set_tests_properties(${ARG_NAME} PROPERTIES LABELS "${labels}" ${ARG_PROPERTIES})
endfunction()

# vergence_benchmark(NAME SOURCES … [DEPENDS …]): a program under build/bench, never run by ctest.
function(vergence_benchmark name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE vergence_options ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bench)
  add_dependencies(benchmarks ${name})
endfunction()
