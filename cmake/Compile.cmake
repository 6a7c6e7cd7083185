# How all of this project's own code is compiled. Directory scope: what a third party adds is not touched.
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON) # for clang-tidy and editors

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release, RelWithDebInfo or MinSizeRel" FORCE)
endif()

# -Wswitch (in -Wall) wants every enumerator in a switch without `default`. -Wswitch-enum would want it in one with
# `default` as well, where leaving some to `default` is the point; so a switch that must stay complete has no `default`.
add_compile_options(
  "$<$<COMPILE_LANGUAGE:C>:-Wall;-Wextra;-Wpedantic;-Wconversion;-Wsign-conversion;-Wshadow;-Wdouble-promotion>"
  "$<$<COMPILE_LANGUAGE:C>:-Wcast-qual;-Wwrite-strings;-Wundef;-Wvla;-Wformat=2;-Wstrict-prototypes;-Wmissing-prototypes>"
  "$<$<BOOL:${DRYRIG_WERROR}>:-Werror>")

if(DRYRIG_SANITIZE OR DRYRIG_FUZZ)
  set(flags -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer "$<$<CONFIG:Debug>:-O1>")
  add_compile_options(${flags})
  add_link_options(${flags})
endif()

if(DRYRIG_FUZZ)
  if(NOT CMAKE_C_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "DRYRIG_FUZZ needs clang (libFuzzer), not ${CMAKE_C_COMPILER_ID}: "
      "configure a fresh build directory with -DCMAKE_C_COMPILER=clang")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

if(DRYRIG_COVERAGE)
  if(NOT CMAKE_C_COMPILER_ID STREQUAL "GNU")
    message(FATAL_ERROR "DRYRIG_COVERAGE needs gcc, not ${CMAKE_C_COMPILER_ID}")
  endif()
  # Tests run side by side and some have threads: counts must not be lost.
  add_compile_options(--coverage -O0 -fprofile-update=atomic)
  add_link_options(--coverage)
endif()
