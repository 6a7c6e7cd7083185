# Cortex-M without an operating system: the board mps2-an385 (Cortex-M3), which QEMU has. Base for others: see PORTING.md.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # nothing can be linked without a linker script
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)

set(DRYRIG_BOARD cortex-m)
set(DRYRIG_CPU "cortex-m3" CACHE STRING "The core, as gcc's -mcpu calls it")
set(CMAKE_C_FLAGS_INIT "-mcpu=${DRYRIG_CPU} -mthumb -ffunction-sections -fdata-sections -fstack-usage")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostartfiles --specs=nano.specs -Wl,--gc-sections")
