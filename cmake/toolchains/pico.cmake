# Raspberry Pi Pico with the Pico SDK: from PICO_SDK_PATH (the variable or the environment's), or from where scripts/setup
# puts Debian's. No toolchain file, for the SDK brings its own: the preset has it included by project().
set(DRYRIG_BOARD pico)
set(PICO_BOARD pico CACHE STRING "Board, as the SDK calls it")
set(PICO_NO_PICOTOOL 1) # uf2.py does what it would be needed for
if(NOT PICO_SDK_PATH AND DEFINED ENV{PICO_SDK_PATH})
  set(PICO_SDK_PATH "$ENV{PICO_SDK_PATH}")
endif()
if(NOT PICO_SDK_PATH)
  set(PICO_SDK_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.deps/pico/pico-sdk")
  set(PICO_TINYUSB_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.deps/pico/tinyusb")
endif()
get_filename_component(PICO_SDK_PATH "${PICO_SDK_PATH}" ABSOLUTE)
if(NOT EXISTS "${PICO_SDK_PATH}/pico_sdk_init.cmake")
  message(FATAL_ERROR "No Pico SDK in ${PICO_SDK_PATH}. Run scripts/setup, or say where it is with -DPICO_SDK_PATH=DIR")
endif()
include("${PICO_SDK_PATH}/pico_sdk_init.cmake")
