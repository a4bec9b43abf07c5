# arm64 Linux from Debian's cross compiler (g++-aarch64-linux-gnu); programs run here under qemu-user.
#   cmake -S . -B build-arm64 --toolchain toolchains/aarch64-linux-gnu.cmake -DVERGENCE_SYSROOT="$(scripts/sysroot arm64)"
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(VERGENCE_TRIPLET aarch64-linux-gnu)
set(VERGENCE_QEMU aarch64)
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
