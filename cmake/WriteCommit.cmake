# cmake -DSOURCE=DIR -DVERSION=X -DOUTPUT=FILE -P WriteCommit.cmake
#
# Writes the one line that defines VersionWithCommit() (libs/base/core/version.h). A file that says so already is left alone,
# so that nothing is compiled or linked again. It runs at each build, as no file of git's changes with every commit.
# Changes that are not committed are not told. A tree that is no repository of its own has no commit.
cmake_minimum_required(VERSION 3.22)

set(text "${VERSION}")
if(EXISTS "${SOURCE}/.git")
  execute_process(COMMAND git -C "${SOURCE}" describe --tags --always --abbrev=10
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
  if(status STREQUAL "0")
    string(APPEND text " (${commit})")
  endif()
endif()

set(line "namespace skein { const char* VersionWithCommit() { return \"${text}\"; } }\n")
set(before "")
if(EXISTS "${OUTPUT}")
  file(READ "${OUTPUT}" before)
endif()
if(NOT "${before}" STREQUAL "${line}")
  file(WRITE "${OUTPUT}" "${line}")
endif()
