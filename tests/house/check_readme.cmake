# The README shows the example as it is built: cmake -DREADME=… -DEXAMPLE=… -P check_readme.cmake
file(READ ${README} readme)
file(READ ${EXAMPLE} example)
string(FIND "${readme}" "${example}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "${README} does not show ${EXAMPLE} as it is; copy it there")
endif()
