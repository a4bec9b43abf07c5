# Cortex-M4 without an operating system from Debian's gcc-arm-none-eabi; no C library is needed.
# firmware_iface/trigger/board/stm32f405 takes it by itself.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfloat-abi=soft")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # a program would need the board's linker script
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
