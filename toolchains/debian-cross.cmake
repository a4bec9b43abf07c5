# What the cross toolchains share: VERGENCE_TRIPLET's compiler from Debian, the libraries of a sysroot, tests run by qemu-user.
# Set before: CMAKE_SYSTEM_PROCESSOR, VERGENCE_TRIPLET, VERGENCE_QEMU (the emulator's name for the processor).
# VERGENCE_SYSROOT: the folder that scripts/sysroot prints, as a variable of the cache or of the environment. Without one only the
# C and C++ libraries of the cross compiler are there, which is enough for firmware_iface.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER ${VERGENCE_TRIPLET}-gcc)
set(CMAKE_CXX_COMPILER ${VERGENCE_TRIPLET}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${VERGENCE_TRIPLET})
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VERGENCE_SYSROOT)

if(NOT VERGENCE_SYSROOT AND DEFINED ENV{VERGENCE_SYSROOT})
  set(VERGENCE_SYSROOT $ENV{VERGENCE_SYSROOT} CACHE PATH "Libraries of the target")
endif()
if(VERGENCE_SYSROOT)
  set(CMAKE_SYSROOT ${VERGENCE_SYSROOT})
  set(CMAKE_FIND_ROOT_PATH ${VERGENCE_SYSROOT})
  set(ENV{PKG_CONFIG_SYSROOT_DIR} ${VERGENCE_SYSROOT})
  set(ENV{PKG_CONFIG_LIBDIR} ${VERGENCE_SYSROOT}/usr/lib/${VERGENCE_TRIPLET}/pkgconfig:${VERGENCE_SYSROOT}/usr/share/pkgconfig)
  set(loader_root ${VERGENCE_SYSROOT})
else()
  set(CMAKE_FIND_ROOT_PATH /usr/${VERGENCE_TRIPLET})
  set(loader_root /usr/${VERGENCE_TRIPLET})
endif()

# Programs of the host, libraries and headers of the target only.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

find_program(VERGENCE_EMULATOR_${VERGENCE_QEMU} NAMES qemu-${VERGENCE_QEMU}-static qemu-${VERGENCE_QEMU})
if(VERGENCE_EMULATOR_${VERGENCE_QEMU})
  # ctest then runs the tests of a cross build as if they were native. -L: where the target's dynamic loader lives.
  set(CMAKE_CROSSCOMPILING_EMULATOR ${VERGENCE_EMULATOR_${VERGENCE_QEMU}} -L ${loader_root})
endif()
