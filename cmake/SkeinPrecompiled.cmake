# Two ways to compile from nothing in less time.
#
# Unity builds: the files of a target are compiled as one, so a header is parsed and a template is instantiated once.
# After a change of one file its whole target is compiled; -DSKEIN_UNITY=OFF suits who works on the code.
option(SKEIN_UNITY "Compile the files of a library, a program or a test as one" OFF)
function(skein_use_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${SKEIN_UNITY} UNITY_BUILD_BATCH_SIZE 12
    UNITY_BUILD_CODE_BEFORE_INCLUDE "// NOLINTNEXTLINE(bugprone-suspicious-include)")
endfunction()

# Precompiled headers: parsing Eigen and the variant of all facts takes most of a compilation.
# They only save time: every file includes what it uses, and SKEIN_PRECOMPILED=OFF (the sanitizer presets) builds without.
option(SKEIN_PRECOMPILED "Precompile the heavy headers" ON)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(-fpch-preprocess) # ccache wants it
endif()

set(precompiled_std <algorithm> <cmath> <filesystem> <functional> <map> <memory> <optional> <set> <string>
  <unordered_map> <variant> <vector>)
set(precompiled_messages "${CMAKE_SOURCE_DIR}/libs/net/ledger/facts.h")
set(precompiled_scene <Eigen/Core> <Eigen/Geometry> "${CMAKE_SOURCE_DIR}/libs/scene/sfm/reconstruction.h")

# skein_precompile(NAME LINKS x... HEADERS h...): what skein_use_precompiled takes headers from.
function(skein_precompile name)
  if(NOT SKEIN_PRECOMPILED)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "LINKS;HEADERS" ${ARGN})
  file(WRITE ${CMAKE_BINARY_DIR}/${name}.cc "")
  add_library(${name} STATIC ${CMAKE_BINARY_DIR}/${name}.cc)
  skein_configure(${name})
  target_link_libraries(${name} PUBLIC ${ARG_LINKS})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Else ccache's preprocessor takes the header of the last build for its own, and nothing seems to have changed.
    target_compile_options(${name} PRIVATE -fno-pch-preprocess)
  endif()
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

# The precompiled headers that fit what a target links, found along its libraries.
function(skein_use_precompiled target)
  if(NOT SKEIN_PRECOMPILED)
    return()
  endif()
  set(links ${ARGN})
  set(seen)
  while(links)
    list(POP_FRONT links link)
    if(link IN_LIST seen)
      continue()
    endif()
    list(APPEND seen ${link})
    if(TARGET ${link} AND link MATCHES "^skein_")
      get_target_property(more ${link} INTERFACE_LINK_LIBRARIES)
      if(more)
        list(APPEND links ${more})
      endif()
    endif()
  endwhile()
  if(skein_ledger IN_LIST seen AND skein_sfm IN_LIST seen)
    target_precompile_headers(${target} REUSE_FROM skein_precompiled_both)
  elseif(skein_ledger IN_LIST seen)
    target_precompile_headers(${target} REUSE_FROM skein_precompiled_messages)
  elseif(skein_sfm IN_LIST seen)
    target_precompile_headers(${target} REUSE_FROM skein_precompiled_scene)
  endif()
endfunction()
