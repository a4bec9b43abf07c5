# arm64 Linux from Debian's cross compiler (g++-aarch64-linux-gnu); programs run here under qemu-user.
#   cmake -S . -B build-arm64 --toolchain toolchains/aarch64-linux-gnu.cmake -DVERGENCE_APP=OFF
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

# Programs of the host, libraries and headers of the target only.
set(CMAKE_FIND_ROOT_PATH /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

find_program(VERGENCE_QEMU_AARCH64 NAMES qemu-aarch64-static qemu-aarch64)
if(VERGENCE_QEMU_AARCH64)
  # ctest then runs the tests of a cross build as if they were native. -L: where the target's dynamic loader lives.
  set(CMAKE_CROSSCOMPILING_EMULATOR ${VERGENCE_QEMU_AARCH64} -L /usr/aarch64-linux-gnu)
endif()
