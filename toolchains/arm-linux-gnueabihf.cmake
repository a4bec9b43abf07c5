# armhf Linux (ARMv7 with VFPv3-D16, Debian's baseline) from Debian's cross compiler (g++-arm-linux-gnueabihf).
#   cmake -S . -B build-armhf --toolchain toolchains/arm-linux-gnueabihf.cmake -DVERGENCE_SYSROOT="$(scripts/sysroot armhf)"
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(VERGENCE_TRIPLET arm-linux-gnueabihf)
set(VERGENCE_QEMU arm)
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
