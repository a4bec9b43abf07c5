# Tests that run inside a Linux kernel of their own, on its real drivers with emulated devices behind them (docs/rigs.md).
set(VERGENCE_RIGS_FOLDER ${PROJECT_SOURCE_DIR}/tests/rigs)
set(VERGENCE_RIGS_PROGRAMS ${PROJECT_BINARY_DIR}/tests/rigs)

# vergence_rig_test(NAME name COMMAND program arguments… [OPTIONS --udev --vivid-loop …] [TIMEOUT seconds] [FILM])
#   one ctest, label rig, alone on the machine; OPTIONS are those of run-in-kernel, TIMEOUT counts inside the kernel.
#   The command runs as root in a folder of its own that survives (build/rigs/NAME), finds the emulators in the
#   environment variable VERGENCE_RIGS, and may end with 77: skipped. FILM: a rendered drive to be played into the cameras is in the
#   folder that VERGENCE_FILM names (tests/rigs/film.hpp; emulators: --film "$VERGENCE_FILM").
# vergence_rig_test(NAME name SOURCES a.cpp … [DEPENDS …] [ARGUMENTS …] …)
#   the same with a GoogleTest program made of these sources.
# Programs with address or thread sanitizer do not fit into the user-mode kernel: these run in run-in-qemu, label slow.
function(vergence_rig_test)
  cmake_parse_arguments(ARG "FILM" "NAME;TIMEOUT" "COMMAND;OPTIONS;SOURCES;DEPENDS;ARGUMENTS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(ARG_SOURCES)
    string(REPLACE "." "_" program ${ARG_NAME})
    add_executable(${program} ${ARG_SOURCES})
    target_link_libraries(${program} PRIVATE vergence_options ${ARG_DEPENDS} GTest::gtest GTest::gtest_main)
    set_target_properties(${program} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
    add_dependencies(${program} vergence_rigs)
    set(ARG_COMMAND $<TARGET_FILE:${program}> ${ARG_ARGUMENTS})
  endif()
  set(runner run-in-kernel)
  set(labels rig)
  if(VERGENCE_SANITIZE MATCHES "address|thread")
    set(runner run-in-qemu)
    list(APPEND labels slow)
    math(EXPR ARG_TIMEOUT "4 * ${ARG_TIMEOUT} + 120")
  endif()
  set(folder ${PROJECT_BINARY_DIR}/rigs/${ARG_NAME})
  file(MAKE_DIRECTORY ${folder})
  math(EXPR outside "${ARG_TIMEOUT} + 30")
  add_test(NAME ${ARG_NAME} WORKING_DIRECTORY ${folder}
    COMMAND ${VERGENCE_RIGS_FOLDER}/${runner} --timeout ${ARG_TIMEOUT} ${ARG_OPTIONS} -- ${ARG_COMMAND})
  set_tests_properties(${ARG_NAME} PROPERTIES LABELS "${labels}" RUN_SERIAL TRUE SKIP_RETURN_CODE 77 TIMEOUT ${outside}
    ENVIRONMENT "VERGENCE_RIGS=${VERGENCE_RIGS_PROGRAMS};VERGENCE_FILM=${PROJECT_BINARY_DIR}/rigs/film")
  set(fixtures)
  if(runner STREQUAL run-in-kernel)
    list(APPEND fixtures rig_kernel)
  endif()
  if(ARG_FILM)
    list(APPEND fixtures rig_film)
  endif()
  set_tests_properties(${ARG_NAME} PROPERTIES FIXTURES_REQUIRED "${fixtures}")
endfunction()
