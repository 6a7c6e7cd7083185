# Tells, when the core was built, what it costs: bytes of code and constants, and bytes of RAM its owner provides.
# Sizes come from objects, not from running anything, so that it works for any target.
if(DRYRIG_SANITIZE OR DRYRIG_FUZZ OR DRYRIG_COVERAGE)
  return() # such builds cost something else
endif()
string(REGEX REPLACE "nm([^/]*)$" "size\\1" DRYRIG_SIZE "${CMAKE_NM}")

get_property(modules DIRECTORY "${PROJECT_SOURCE_DIR}/firmware/core" PROPERTY BUILDSYSTEM_TARGETS)
set(structs dr_controller dr_drive dr_note dr_panel dr_panel_drive)
set(source "#include \"dr_panel.h\"\n")
foreach(struct IN LISTS structs)
  string(APPEND source "extern char size_of_${struct}[sizeof(${struct})];\nchar size_of_${struct}[sizeof(${struct})];\n")
endforeach()
file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/core_structs.c" CONTENT "${source}")
add_library(core_structs OBJECT "${CMAKE_CURRENT_BINARY_DIR}/core_structs.c")
target_link_libraries(core_structs PRIVATE dr_panel)
set_target_properties(core_structs PROPERTIES EXPORT_COMPILE_COMMANDS OFF)

set(archives ${modules})
list(TRANSFORM archives REPLACE "(.+)" "$<TARGET_FILE:\\1>")
add_custom_command(OUTPUT "${PROJECT_BINARY_DIR}/core_size.txt"
  COMMAND ${CMAKE_COMMAND} "-DSIZE=${DRYRIG_SIZE}" "-DNM=${CMAKE_NM}" "-DARCHIVES=${archives}"
    "-DSTRUCTS=$<TARGET_OBJECTS:core_structs>" "-DOUTPUT=${PROJECT_BINARY_DIR}/core_size.txt"
    "-DCOMPILER=${CMAKE_C_COMPILER_ID} ${CMAKE_C_COMPILER_VERSION}, $<CONFIG>"
    -P "${CMAKE_CURRENT_LIST_DIR}/core_size.cmake"
  DEPENDS ${modules} core_structs "$<TARGET_OBJECTS:core_structs>" "${CMAKE_CURRENT_LIST_DIR}/core_size.cmake"
  COMMENT "Sizes of the core" VERBATIM)
add_custom_target(core_size ALL DEPENDS "${PROJECT_BINARY_DIR}/core_size.txt")
