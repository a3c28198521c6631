# skein_library(NAME SOURCES a.cc ... LINKS x y ...)    a library of our own, warnings are errors
# skein_executable(NAME SOURCES main.cc ... LINKS ...)
# skein_test(NAME SOURCES x_test.cc ... LINKS ... [LABELS process] [TIMEOUT s])
#
# Headers are included from libs/ and services/: "core/hash.h", "matching/kernel.h".
# The target "product" builds the executables and the jar: all that a user runs, no tests.
add_custom_target(product)

function(skein_configure target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${target} PUBLIC ${CMAKE_SOURCE_DIR}/libs ${CMAKE_SOURCE_DIR}/services
    ${CMAKE_SOURCE_DIR})
  if(SKEIN_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${SKEIN_SANITIZE} -fno-omit-frame-pointer
      -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${SKEIN_SANITIZE})
  endif()
endfunction()

function(skein_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PUBLIC ${ARG_LINKS})
endfunction()

function(skein_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS})
  if(NOT CMAKE_CURRENT_SOURCE_DIR MATCHES "/benchmark$")
    add_dependencies(product ${name})
  endif()
endfunction()

function(skein_test name)
  if(NOT SKEIN_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINKS;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE SKEIN_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    SKEIN_BINARY_DIR="${CMAKE_BINARY_DIR}")
  set(environment)
  if(SKEIN_SANITIZE MATCHES thread)
    set(environment ENVIRONMENT "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/cmake/tsan.supp")
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}" ${environment})
endfunction()
