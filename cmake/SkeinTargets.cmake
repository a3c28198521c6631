# skein_library(NAME SOURCES a.cc ... LINKS x y ...)    a library of our own, warnings are errors;
#   PRIVATE_LINKS z ...: what its headers do not include
# skein_executable(NAME SOURCES main.cc ... LINKS ...)
# skein_test_needs(NAME TARGET ...)                     programs that the test starts
# skein_test(NAME SOURCES x_test.cc ... LINKS ... [LABELS process] [TIMEOUT s])
#
# Headers are included from the floors of libs/ and from services/: "core/hash.h", "matching/kernel.h".
# The target "product" builds the executables and the jar: all that a user runs, no tests.
# "reconstruction" is what scripts/reconstruct.sh starts: the skein command and the services.
add_custom_target(product)
add_custom_target(reconstruction)
set(SKEIN_BENCHMARK_DIR ${CMAKE_SOURCE_DIR}/benchmark)
set(SKEIN_FLOORS base net scene images dense state view)
list(TRANSFORM SKEIN_FLOORS PREPEND ${CMAKE_SOURCE_DIR}/libs/ OUTPUT_VARIABLE SKEIN_FLOOR_DIRS)

function(skein_configure target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${target} PUBLIC ${SKEIN_FLOOR_DIRS} ${CMAKE_SOURCE_DIR}/libs ${CMAKE_SOURCE_DIR}/services
    ${CMAKE_SOURCE_DIR})
  if(SKEIN_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${SKEIN_SANITIZE} -fno-omit-frame-pointer
      -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${SKEIN_SANITIZE})
  endif()
  if(SKEIN_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

function(skein_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PUBLIC ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  skein_use_precompiled(${name} ${ARG_LINKS})
  skein_use_unity(${name})
endfunction()

# Kernels: PREFIX.cc, which chooses, and a file for each instruction set, PREFIX_portable.cc and so on, with FLAGS and its -m
# flags. These files include neither Eigen nor OpenCV, whose layout depends on the flags.
function(skein_kernel_library name)
  cmake_parse_arguments(ARG "" "PREFIX" "FLAGS;AVX512_FLAGS" ${ARGN})
  set(sources ${ARG_PREFIX}.cc ${ARG_PREFIX}_portable.cc)
  set_source_files_properties(${ARG_PREFIX}_portable.cc PROPERTIES COMPILE_OPTIONS "${ARG_FLAGS}")
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND sources ${ARG_PREFIX}_avx2.cc ${ARG_PREFIX}_avx512.cc)
    set_source_files_properties(${ARG_PREFIX}_avx2.cc PROPERTIES COMPILE_OPTIONS "${ARG_FLAGS};-mavx2;-mfma")
    set_source_files_properties(${ARG_PREFIX}_avx512.cc PROPERTIES COMPILE_OPTIONS
      "${ARG_FLAGS};-mavx512f;-mavx512bw;-mavx512dq;-mavx512vl;-mfma;${ARG_AVX512_FLAGS}")
  endif()
  skein_library(${name} SOURCES ${sources} LINKS skein_core)
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF) # each file has flags of its own
endfunction()

function(skein_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS})
  skein_use_precompiled(${name} ${ARG_LINKS})
  skein_use_unity(${name})
  cmake_path(IS_PREFIX SKEIN_BENCHMARK_DIR ${CMAKE_CURRENT_SOURCE_DIR} is_benchmark)
  if(NOT is_benchmark)
    add_dependencies(product ${name})
  endif()
endfunction()

# The files of a test are compiled as one: each has a namespace of its name, skein::core_test. One process runs all cases:
# with one a case, loading its libraries took most of the time. scripts/count_cases.py counts the cases.
function(skein_test name)
  if(NOT SKEIN_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINKS;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  skein_configure(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} GTest::gtest GTest::gtest_main)
  skein_use_precompiled(${name} ${ARG_LINKS})
  skein_use_unity(${name})
  target_compile_definitions(${name} PRIVATE SKEIN_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    SKEIN_BINARY_DIR="${CMAKE_BINARY_DIR}")
  set(environment "XDG_STATE_HOME=${CMAKE_BINARY_DIR}/test_state") # not the user's own
  if(SKEIN_SANITIZE MATCHES thread)
    list(APPEND environment "TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/cmake/tsan.supp")
  endif()
  add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 --gtest_output=xml:${CMAKE_BINARY_DIR}/test_cases/${name}.xml)
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}" ENVIRONMENT "${environment}")
endfunction()

# skein_test_needs(NAME TARGET...): programs that the test starts
function(skein_test_needs name)
  if(SKEIN_TESTS)
    add_dependencies(${name} ${ARGN})
  endif()
endfunction()

# Writes build/link_graph.txt: a line "TARGET FOLDER: LINKED..." for each library of ours, as CMake links it.
# tests/static/layering_test.sh holds it against tests/static/layers.txt.
function(skein_collect_libraries folder result)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(subfolder ${folders})
    skein_collect_libraries(${subfolder} below)
    list(APPEND targets ${below})
  endforeach()
  set(${result} ${targets} PARENT_SCOPE)
endfunction()

function(skein_write_link_graph)
  skein_collect_libraries(${CMAKE_SOURCE_DIR} targets)
  set(text "")
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(NOT type STREQUAL STATIC_LIBRARY AND NOT type STREQUAL EXECUTABLE)
      continue()
    endif()
    get_target_property(folder ${target} SOURCE_DIR)
    get_target_property(links ${target} LINK_LIBRARIES)
    file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${folder})
    list(FILTER links INCLUDE REGEX "^skein_")
    list(JOIN links " " links)
    string(APPEND text "${target} ${folder}: ${links}\n")
  endforeach()
  file(WRITE ${CMAKE_BINARY_DIR}/link_graph.txt "${text}")
endfunction()
