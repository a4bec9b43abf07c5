# How every target of the project is made: one place for warnings, include root and test registration.

add_library(vergence_options INTERFACE)
target_include_directories(vergence_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(vergence_options INTERFACE
  -Wall -Wextra -Wshadow $<$<COMPILE_LANGUAGE:CXX>:-Wconversion> $<$<COMPILE_LANGUAGE:C>:-Wconversion> -Werror)
# The same bits on every machine: no fused multiply-add behind our back on targets that have it.
target_compile_options(vergence_options INTERFACE -ffp-contract=off)
if(VERGENCE_SANITIZE)
  target_compile_options(vergence_options INTERFACE -fsanitize=${VERGENCE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(vergence_options INTERFACE -fsanitize=${VERGENCE_SANITIZE})
endif()

# vergence_library(NAME SOURCES a.cpp b.cpp [DEPENDS targets…]): the library of one room.
# Without sources it is a header-only room.
function(vergence_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC vergence_options ${ARG_DEPENDS})
    if(COMMAND vergence_precompiled)
      vergence_precompiled(${name})
    endif()
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE vergence_options ${ARG_DEPENDS})
  endif()
endfunction()

# vergence_test(NAME SOURCES … [DEPENDS …] [LABELS slow …] [SERIAL]): one GoogleTest program, one ctest a case.
# SERIAL: its tests run alone (image rate, timing of threads).
function(vergence_test name)
  cmake_parse_arguments(ARG "SERIAL" "TIMEOUT" "SOURCES;DEPENDS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE vergence_options ${ARG_DEPENDS} GTest::gtest GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  set(properties TIMEOUT ${ARG_TIMEOUT})
  if(ARG_LABELS)
    list(APPEND properties LABELS "${ARG_LABELS}")
  endif()
  if(ARG_SERIAL)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  # Parameters that print as bytes would make a name of addresses.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES PROPERTIES ${properties})
endfunction()

# vergence_benchmark(NAME SOURCES … [DEPENDS …]): a program under build/bench, never run by ctest.
function(vergence_benchmark name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE vergence_options ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bench)
endfunction()
