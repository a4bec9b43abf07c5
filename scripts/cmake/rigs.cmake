# Tests that run inside a Linux kernel of their own, on its real drivers with emulated devices behind them (tests/rigs/README.md).
set(VERGENCE_RIGS_FOLDER ${PROJECT_SOURCE_DIR}/tests/rigs)
set(VERGENCE_RIGS_PROGRAMS ${PROJECT_BINARY_DIR}/tests/rigs)

# vergence_rig_test(NAME name COMMAND program arguments… [OPTIONS --udev --vivid-loop …] [TIMEOUT seconds] [COST seconds] [FILM])
#   one ctest of the tier rig, alone on the machine; OPTIONS are those of run-in-kernel, TIMEOUT counts inside the kernel.
#   The command runs as root in a folder of its own that survives (build/rigs/NAME), finds the emulators in the
#   environment variable VERGENCE_RIGS, and may end with 77: skipped. FILM: a rendered drive to be played into the cameras is in the
#   folder that VERGENCE_FILM names (tests/rigs/film.hpp; emulators: --film "$VERGENCE_FILM").
# vergence_rig_test(NAME name SOURCES a.cpp … [DEPENDS …] [ARGUMENTS …] …)
#   the same with a GoogleTest program made of these sources.
# Programs with address or thread sanitizer do not fit into the user-mode kernel: these run in run-in-qemu.
function(vergence_rig_test)
  cmake_parse_arguments(ARG "FILM;PROGRAM" "NAME;TIMEOUT;COST" "COMMAND;OPTIONS;SOURCES;DEPENDS;ARGUMENTS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(ARG_SOURCES)
    string(REPLACE "." "_" program ${ARG_NAME})
    set(options)
    if(ARG_PROGRAM)
      set(options PROGRAM)
    endif()
    vergence_test_program(${program} rig SOURCES ${ARG_SOURCES} DEPENDS ${ARG_DEPENDS} GTest::gtest GTest::gtest_main ${options})
    add_dependencies(${program} vergence_rigs)
    set(ARG_COMMAND $<TARGET_FILE:${program}> ${ARG_ARGUMENTS})
  endif()
  set(runner run-in-kernel)
  if(VERGENCE_SANITIZE MATCHES "address|thread")
    set(runner run-in-qemu)
    math(EXPR ARG_TIMEOUT "4 * ${ARG_TIMEOUT} + 120")
  endif()
  set(folder ${PROJECT_BINARY_DIR}/rigs/${ARG_NAME})
  file(MAKE_DIRECTORY ${folder})
  math(EXPR outside "${ARG_TIMEOUT} + 30")
  vergence_command_test(NAME ${ARG_NAME} TIER rig
    COMMAND ${VERGENCE_RIGS_FOLDER}/${runner} --timeout ${ARG_TIMEOUT} ${ARG_OPTIONS} -- ${ARG_COMMAND}
    PROPERTIES WORKING_DIRECTORY ${folder} RUN_SERIAL TRUE SKIP_RETURN_CODE 77 TIMEOUT ${outside})
  set_tests_properties(${ARG_NAME} PROPERTIES
    ENVIRONMENT "VERGENCE_RIGS=${VERGENCE_RIGS_PROGRAMS};VERGENCE_FILM=${PROJECT_BINARY_DIR}/rigs/film")
  if(NOT ARG_COST)
    set(ARG_COST 20)
  endif()
  set_tests_properties(${ARG_NAME} PROPERTIES COST ${ARG_COST})
  set(fixtures)
  if(runner STREQUAL run-in-kernel)
    list(APPEND fixtures rig_kernel)
  endif()
  if(ARG_FILM)
    list(APPEND fixtures rig_film)
  endif()
  set_tests_properties(${ARG_NAME} PROPERTIES FIXTURES_REQUIRED "${fixtures}")
endfunction()
