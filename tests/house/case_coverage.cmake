# Fails to configure while a kernel of kernels/kernels.def is named by no KERNELS(...) line of a case.
set(kernels_def ${PROJECT_SOURCE_DIR}/kernels/kernels.def)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${kernels_def} ${SMURF_CASES})

file(STRINGS ${kernels_def} kernel_lines REGEX "^KERNEL\\([a-z_0-9]+,")
list(TRANSFORM kernel_lines REPLACE "^KERNEL\\(([a-z_0-9]+),.*" "\\1" OUTPUT_VARIABLE kernels)

set(covered "")
foreach(case ${SMURF_CASES})
  file(READ ${case} text)
  string(REGEX MATCHALL "\nKERNELS\\([^)]*\\)" covers "${text}")
  foreach(line ${covers})
    string(REGEX REPLACE "[ \n]+" " " line "${line}")
    string(REGEX REPLACE "^ KERNELS\\(([^)]*)\\).*" "\\1" names "${line}")
    string(REPLACE "," ";" names "${names}")
    list(TRANSFORM names STRIP)
    list(APPEND covered ${names})
  endforeach()
endforeach()

foreach(kernel ${kernels})
  if(NOT kernel IN_LIST covered)
    message(FATAL_ERROR "Kernel ${kernel} of kernels/kernels.def is tested by no case: name it in a KERNELS(...) line "
                        "of a file in tests/cases that exercises it.")
  endif()
  if(NOT EXISTS ${PROJECT_SOURCE_DIR}/kernels/entries/${kernel}.cl)
    message(FATAL_ERROR "Kernel ${kernel} of kernels/kernels.def has no kernels/entries/${kernel}.cl.")
  endif()
endforeach()
