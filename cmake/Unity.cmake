# The target `unity`: ThrowTheSwitch's test framework. Never downloads: scripts/setup does that, before.
# Looked for in UNITY_ROOT (upstream's tree, or a directory with unity.c), where scripts/setup puts it, and where Debian
# 13's package cmock has it.
set(UNITY_ROOT "" CACHE PATH "Directory of Unity's sources, where it is not found by itself")
find_path(UNITY_SOURCE_DIR unity.c NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH PATH_SUFFIXES src
  HINTS "${UNITY_ROOT}" "$ENV{UNITY_ROOT}" "${PROJECT_SOURCE_DIR}/.deps/unity" PATHS /usr/share/cmock/vendor/unity)
mark_as_advanced(UNITY_SOURCE_DIR)
if(NOT UNITY_SOURCE_DIR)
  message(FATAL_ERROR "The tests need Unity, and it is not here. Run scripts/setup, "
    "or say where it is with -DUNITY_ROOT=DIR, or build without the tests: -DDRYRIG_TESTS=OFF")
endif()

add_library(unity STATIC EXCLUDE_FROM_ALL "${UNITY_SOURCE_DIR}/unity.c")
target_include_directories(unity SYSTEM PUBLIC "${UNITY_SOURCE_DIR}")
target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE) # the host library has microns in double
target_compile_options(unity PRIVATE -w) # not our code
set_target_properties(unity PROPERTIES C_CLANG_TIDY "" EXPORT_COMPILE_COMMANDS OFF)
