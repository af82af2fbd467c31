# The floors of host/ and bench/ hold: no file includes what stands above its own room. Folders and files keep a size
# that a reader can take in.
#   cmake -DROOT=<the repository> -P floors.cmake
# Rooms from the top; those in one line stand beside each other and do not include each other
# (host/docs/architecture.md).
cmake_minimum_required(VERSION 3.25)
set(floors
  "cli bench"
  "techniques"
  "reference"
  "api"
  "surfaces"
  "flows"
  "io"
  "meshes fields bvh patches"
  "expression"
  "device"
  "numerics"
  "kernels"
  "smurf")

set(height 0)
foreach(floor ${floors})
  string(REPLACE " " ";" rooms "${floor}")
  foreach(room ${rooms})
    set(floor_of_${room} ${height})
  endforeach()
  math(EXPR height "${height} + 1")
endforeach()

file(GLOB_RECURSE files RELATIVE ${ROOT}
  ${ROOT}/host/*.cpp ${ROOT}/host/*.hpp ${ROOT}/bench/*.cpp ${ROOT}/bench/*.hpp ${ROOT}/kernels/*.inc)
list(FILTER files EXCLUDE REGEX "^host/examples/")
list(LENGTH files file_count)
set(arrows 0)
set(faults "")
foreach(file ${files})
  if(file MATCHES "^bench/")
    set(room bench)
  elseif(file MATCHES "^kernels/")
    set(room kernels)
  elseif(file MATCHES "^host/include/")
    set(room smurf)
  elseif(file MATCHES "^host/([a-z_]+)/")
    set(room ${CMAKE_MATCH_1})
  else()
    string(APPEND faults "${file} stands in no room\n")
    continue()
  endif()
  if(NOT DEFINED floor_of_${room})
    string(APPEND faults "${file}: the room ${room} is on no floor; name it in tests/house/floors.cmake\n")
    continue()
  endif()
  file(STRINGS ${ROOT}/${file} includes REGEX "^[ \t]*#[ \t]*include \"")
  foreach(line ${includes})
    string(REGEX REPLACE ".*include \"([^\"/]*)[^\"]*\".*" "\\1" to "${line}")
    if(room STREQUAL "kernels" OR NOT DEFINED floor_of_${to})
      continue()  # kernels include each other by their folders; a file of the same folder
    endif()
    math(EXPR arrows "${arrows} + 1")
    if(NOT to STREQUAL room AND NOT floor_of_${to} GREATER floor_of_${room})
      string(APPEND faults "${file} includes ${to}, which does not stand below ${room}: ${line}\n")
    endif()
  endforeach()
endforeach()

# What a newcomer can take in: files of a folder, lines of a file.
set(most_files 25)
set(most_lines 600)
file(GLOB_RECURSE all RELATIVE ${ROOT}
  ${ROOT}/host/* ${ROOT}/kernels/* ${ROOT}/shaders/* ${ROOT}/tests/* ${ROOT}/bench/*)
foreach(file ${all})
  get_filename_component(folder ${file} DIRECTORY)
  string(MAKE_C_IDENTIFIER "files_in_${folder}" count)
  if(NOT DEFINED ${count})
    set(${count} 0)
  endif()
  math(EXPR ${count} "${${count}} + 1")
  if(${${count}} GREATER ${most_files})
    string(APPEND faults "${folder} has more than ${most_files} files\n")
  endif()
  if(file MATCHES "\\.(cpp|hpp|inc|cl|glsl|cmake)$")
    file(READ ${ROOT}/${file} text)
    string(REGEX REPLACE "[^\n]" "" ends "${text}")
    string(LENGTH "${ends}" line_count)
    if(line_count GREATER most_lines)
      string(APPEND faults "${file} has ${line_count} lines, more than ${most_lines}\n")
    endif()
  endif()
endforeach()

if(arrows LESS 300)
  message(FATAL_ERROR "Only ${arrows} includes were found in ${file_count} files: this test looks in the wrong place.")
endif()
if(faults)
  message(FATAL_ERROR "The house does not hold:\n${faults}")
endif()
message(STATUS
  "${arrows} includes, none runs up; folders of ${most_files} files at most, files of ${most_lines} lines")
