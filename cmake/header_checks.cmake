# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Target truing_headers: every header, public or internal, compiles alone, and all of them compile together, in either
# order. A header that a source includes first is compiled alone there. Nothing is linked or optimised: only whether it
# compiles is asked.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/cpp/src/*.hpp"
     "${PROJECT_SOURCE_DIR}/cpp/include/truing/*.hpp")
list(SORT headers)
set(generated "${CMAKE_CURRENT_BINARY_DIR}/headers")

function(truing_write_includes name)
  set(text "")
  foreach(header ${ARGN})
    string(APPEND text "#include \"${header}\"\n")
  endforeach()
  file(CONFIGURE OUTPUT "${generated}/${name}.cpp" CONTENT "${text}" @ONLY) # untouched where it is the same
endfunction()

set(units all_forwards all_backwards)
truing_write_includes(all_forwards ${headers})
set(backwards ${headers})
list(REVERSE backwards)
truing_write_includes(all_backwards ${backwards})

set(first_includes "")
file(GLOB_RECURSE own_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/cpp/src/*.cpp")
foreach(source ${own_sources})
  file(STRINGS ${source} include REGEX "^#include" LIMIT_COUNT 1)
  if(include MATCHES "\"(.+)\"")
    list(APPEND first_includes "${PROJECT_SOURCE_DIR}/cpp/src/${CMAKE_MATCH_1}"
         "${PROJECT_SOURCE_DIR}/cpp/include/${CMAKE_MATCH_1}")
  endif()
endforeach()
list(REMOVE_ITEM headers ${first_includes})
foreach(header ${headers})
  file(RELATIVE_PATH unit "${PROJECT_SOURCE_DIR}/cpp" "${header}")
  string(REGEX REPLACE "[/.]" "_" unit "${unit}")
  truing_write_includes(${unit} "${header}")
  list(APPEND units ${unit})
endforeach()

list(TRANSFORM units REPLACE "(.+)" "${generated}/\\1.cpp" OUTPUT_VARIABLE sources)
add_library(truing_headers OBJECT ${sources})
truing_own_target(truing_headers)
target_include_directories(truing_headers PRIVATE "${PROJECT_SOURCE_DIR}/cpp/src")
target_link_libraries(truing_headers PRIVATE truing::truing)
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  target_compile_options(truing_headers PRIVATE -O0)
endif()
