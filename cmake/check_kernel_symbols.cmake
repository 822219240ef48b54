# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Fails when a kernel object defines weak (shareable) symbols outside the namespace of its instruction set.
# Usage: cmake -DNM=nm -DOBJECTS=a.o -DNAMESPACE=avx2 -P check_kernel_symbols.cmake
set(found "")
foreach(object ${OBJECTS})
  execute_process(COMMAND "${NM}" -C --defined-only "${object}" OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "," symbols "${symbols}")
  string(REPLACE "\n" ";" symbols "${symbols}")
  foreach(symbol ${symbols})
    # W, V: weak; u: unique. Lower-case w and v would be undefined.
    if(symbol MATCHES "^[0-9a-f]* *[WVu] (.*)$")
      set(name "${CMAKE_MATCH_1}")
      if(NOT name MATCHES "(^|::| )${NAMESPACE}::")
        string(APPEND found "\n  ${name}")
      endif()
    endif()
  endforeach()
endforeach()
if(found)
  message(FATAL_ERROR "kernel copy '${NAMESPACE}' shares these symbols with code for other machines; use raw arrays "
                      "and functions of its own namespace instead:${found}")
endif()
