# What every directory of tests/ uses.
include(Unity)

# Python of the system, where scripts/setup puts the modules; not one of a version manager or of a virtual environment.
find_program(DRYRIG_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)

# A sanitizer's report ends the test, with a stack. A socket's path has 107 bytes at most, and the TMPDIR of a CI server more.
set(DRYRIG_TEST_ENVIRONMENT "TMPDIR=/tmp"
  "ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1" "UBSAN_OPTIONS=print_stacktrace=1")

# dr_test(NAME SOURCES FILE... [LIBS TARGET...] [ARGS ARG...] [LABELS LABEL...] [TIMEOUT SECONDS])
#   A Unity test program of that name, and a test of that name that runs it. Unity is linked; LIBS are what is tested.
#   The name of the directory is always a label. A test may take 900 s, where nothing else is said: many times what any needs, as machines are busy.
function(dr_test name)
  cmake_parse_arguments(PARSE_ARGV 1 test "" "TIMEOUT" "SOURCES;LIBS;ARGS;LABELS")
  if(NOT test_SOURCES OR test_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "dr_test(${name} SOURCES FILE... [LIBS TARGET...] [ARGS ARG...] [LABELS LABEL...] [TIMEOUT SECONDS])"
      " cannot use: ${test_UNPARSED_ARGUMENTS}")
  endif()
  add_executable(${name} ${test_SOURCES})
  target_link_libraries(${name} PRIVATE unity ${test_LIBS})
  add_test(NAME ${name} COMMAND ${name} ${test_ARGS})
  dr_test_properties(${name} LABELS ${test_LABELS} TIMEOUT ${test_TIMEOUT})
endfunction()

# dr_script_test(NAME COMMAND COMMAND ARG... [LABELS LABEL...] [TIMEOUT SECONDS] [ENVIRONMENT NAME=VALUE...])
#   A test that is a command: a script, or a program with arguments. ${DRYRIG_PYTHON} is the Python to use.
function(dr_script_test name)
  cmake_parse_arguments(PARSE_ARGV 1 test "" "TIMEOUT" "COMMAND;LABELS;ENVIRONMENT")
  if(NOT test_COMMAND OR test_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "dr_script_test(${name} COMMAND COMMAND ARG... [LABELS LABEL...] [TIMEOUT SECONDS] "
      "[ENVIRONMENT NAME=VALUE...]) cannot use: ${test_UNPARSED_ARGUMENTS}")
  endif()
  add_test(NAME ${name} COMMAND ${test_COMMAND})
  dr_test_properties(${name} LABELS ${test_LABELS} TIMEOUT ${test_TIMEOUT} ENVIRONMENT ${test_ENVIRONMENT})
endfunction()

function(dr_test_properties name)
  cmake_parse_arguments(PARSE_ARGV 1 test "" "TIMEOUT" "LABELS;ENVIRONMENT")
  if(NOT test_TIMEOUT)
    set(test_TIMEOUT 900)
  endif()
  get_filename_component(directory "${CMAKE_CURRENT_SOURCE_DIR}" NAME)
  set_tests_properties(${name} PROPERTIES TIMEOUT ${test_TIMEOUT} LABELS "${directory};${test_LABELS}"
    ENVIRONMENT "${DRYRIG_TEST_ENVIRONMENT};${test_ENVIRONMENT}")
endfunction()

# dr_fuzz(NAME SOURCES FILE... [LIBS TARGET...] [CORPUS DIRECTORY] [SECONDS N])
#   A libFuzzer program of that name, and a test (label: fuzz) that runs it for N seconds (10) from the corpus, which
#   stays as it is: what is found new is kept below the build directory. Nothing without DRYRIG_FUZZ.
set(DRYRIG_FUZZ_SECONDS "" CACHE STRING "Seconds that every fuzzing program runs as a test, instead of its own number")
function(dr_fuzz name)
  cmake_parse_arguments(PARSE_ARGV 1 fuzz "" "CORPUS;SECONDS" "SOURCES;LIBS")
  if(NOT fuzz_SOURCES OR fuzz_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "dr_fuzz(${name} SOURCES FILE... [LIBS TARGET...] [CORPUS DIRECTORY] [SECONDS N])"
      " cannot use: ${fuzz_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT DRYRIG_FUZZ)
    return()
  endif()
  if(DRYRIG_FUZZ_SECONDS)
    set(fuzz_SECONDS ${DRYRIG_FUZZ_SECONDS})
  elseif(NOT fuzz_SECONDS)
    set(fuzz_SECONDS 10)
  endif()
  add_executable(${name} ${fuzz_SOURCES})
  target_link_libraries(${name} PRIVATE ${fuzz_LIBS})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  set(found "${CMAKE_CURRENT_BINARY_DIR}/${name}.found")
  file(MAKE_DIRECTORY "${found}")
  set(corpus "")
  if(fuzz_CORPUS)
    get_filename_component(corpus "${fuzz_CORPUS}" ABSOLUTE)
  endif()
  add_test(NAME ${name} COMMAND ${name} -max_total_time=${fuzz_SECONDS} -timeout=60 -print_final_stats=1
    "-artifact_prefix=${found}/" "${found}" ${corpus})
  math(EXPR timeout "${fuzz_SECONDS} + 600")
  dr_test_properties(${name} LABELS fuzz TIMEOUT ${timeout})
endfunction()
