# Configures the project for arm64 in a folder of its own, builds firmware_iface with its tests and runs them under qemu-user.
#   cmake -DSOURCE=… -DBUILD=… -P cross_arm64.cmake        exit: SKIPPED in the output where a tool is missing
find_program(compiler aarch64-linux-gnu-g++)
find_program(qemu NAMES qemu-aarch64-static qemu-aarch64)
if(NOT compiler OR NOT qemu)
  message("SKIPPED: needs aarch64-linux-gnu-g++ and qemu-aarch64 (packages g++-aarch64-linux-gnu, qemu-user-static)")
  return()
endif()

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}")
  endif()
endfunction()

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} -G Ninja --toolchain ${SOURCE}/toolchains/aarch64-linux-gnu.cmake
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DVERGENCE_APP=OFF)
run(${CMAKE_COMMAND} --build ${BUILD} --target tests_default)
# An empty list of tests would prove nothing: ctest fails on it.
run(${CMAKE_CTEST_COMMAND} --test-dir ${BUILD} --output-on-failure --no-tests=error)
