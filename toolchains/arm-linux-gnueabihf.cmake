# armhf Linux (ARMv7 with VFPv3-D16, Debian's baseline) from Debian's cross compiler (g++-arm-linux-gnueabihf).
#   cmake -S . -B build-armhf --toolchain toolchains/arm-linux-gnueabihf.cmake -DVERGENCE_SYSROOT="$(scripts/sysroot armhf)"
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(VERGENCE_TRIPLET arm-linux-gnueabihf)
set(VERGENCE_QEMU arm)
# Everything here is of one compiler: that GCC 7 changed how 8-byte aligned structs are passed is no news.
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
