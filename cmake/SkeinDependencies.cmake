# Everything Skein links. All are packages of Debian 12 and 13 (scripts/setup.sh installs them),
# but for ONNX Runtime, of 13 alone, and the part of COLMAP that scripts/setup.sh builds.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(Ceres 2.1 REQUIRED)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d dnn flann objdetect)
find_package(SQLite3 REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(Boost REQUIRED COMPONENTS filesystem system)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)

# pkg-config lcm fails on Debian 12 without glib's dev package: find it directly.
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
find_file(LCM_JAR lcm.jar PATHS /usr/share/java REQUIRED)
add_library(lcm INTERFACE)
target_include_directories(lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
target_link_libraries(lcm INTERFACE ${LCM_LIBRARY} Threads::Threads)

find_path(EXIF_INCLUDE_DIR libexif/exif-data.h REQUIRED)
find_library(EXIF_LIBRARY exif REQUIRED)
add_library(exif INTERFACE)
target_include_directories(exif SYSTEM INTERFACE ${EXIF_INCLUDE_DIR})
target_link_libraries(exif INTERFACE ${EXIF_LIBRARY})

find_path(SODIUM_INCLUDE_DIR sodium.h REQUIRED)
find_library(SODIUM_LIBRARY sodium REQUIRED)
add_library(sodium INTERFACE)
target_include_directories(sodium SYSTEM INTERFACE ${SODIUM_INCLUDE_DIR})
target_link_libraries(sodium INTERFACE ${SODIUM_LIBRARY})

find_path(QRENCODE_INCLUDE_DIR qrencode.h REQUIRED)
find_library(QRENCODE_LIBRARY qrencode REQUIRED)
add_library(qrencode INTERFACE)
target_include_directories(qrencode SYSTEM INTERFACE ${QRENCODE_INCLUDE_DIR})
target_link_libraries(qrencode INTERFACE ${QRENCODE_LIBRARY})

find_path(SECCOMP_INCLUDE_DIR seccomp.h REQUIRED)
find_library(SECCOMP_LIBRARY seccomp REQUIRED)
add_library(seccomp INTERFACE)
target_include_directories(seccomp SYSTEM INTERFACE ${SECCOMP_INCLUDE_DIR})
target_link_libraries(seccomp INTERFACE ${SECCOMP_LIBRARY})

# ONNX Runtime, which Debian 13 has, runs learned descriptors, else OpenCV's DNN module.
# -DONNXRUNTIME_LIBRARY=OFF chooses OpenCV.
find_path(ONNXRUNTIME_INCLUDE_DIR onnxruntime_cxx_api.h PATH_SUFFIXES onnxruntime)
find_library(ONNXRUNTIME_LIBRARY onnxruntime)
if(ONNXRUNTIME_INCLUDE_DIR AND ONNXRUNTIME_LIBRARY)
  add_library(onnxruntime INTERFACE)
  target_include_directories(onnxruntime SYSTEM INTERFACE ${ONNXRUNTIME_INCLUDE_DIR})
  target_link_libraries(onnxruntime INTERFACE ${ONNXRUNTIME_LIBRARY})
endif()

find_path(HNSWLIB_INCLUDE_DIR hnswlib/hnswlib.h REQUIRED)
add_library(hnswlib INTERFACE)
target_include_directories(hnswlib SYSTEM INTERFACE ${HNSWLIB_INCLUDE_DIR})
if(SKEIN_SANITIZE)
  # Its prefetching reads the link behind the last one, to no effect but AddressSanitizer's.
  target_compile_definitions(hnswlib INTERFACE NO_MANUAL_VECTORIZATION)
endif()

# COLMAP: the BSD part that cmake/colmap builds. Headers are included as COLMAP's own files include each other
# ("base/camera.h" in 3.8, "colmap/scene/camera.h" from 3.9 on); libs/scene/sfm/colmap_api.h alone does.
set(SKEIN_COLMAP_DIR "${CMAKE_SOURCE_DIR}/.deps/colmap" CACHE PATH "Where scripts/setup.sh installed COLMAP's part")
if(NOT "$ENV{SKEIN_COLMAP_DIR}" STREQUAL "")
  set(SKEIN_COLMAP_DIR "$ENV{SKEIN_COLMAP_DIR}" CACHE PATH "" FORCE)
endif()
find_library(SKEIN_COLMAP_LIBRARY skein_colmap PATHS ${SKEIN_COLMAP_DIR}/lib NO_DEFAULT_PATH NO_CACHE)
if(NOT SKEIN_COLMAP_LIBRARY)
  message(FATAL_ERROR "No libskein_colmap.a in ${SKEIN_COLMAP_DIR}/lib; run scripts/setup.sh first")
endif()
find_library(GLOG_LIBRARY glog REQUIRED)
# Imported, so that the linker sees what it needs after it whatever else needs the same.
add_library(colmap STATIC IMPORTED GLOBAL)
set_target_properties(colmap PROPERTIES IMPORTED_LOCATION ${SKEIN_COLMAP_LIBRARY})
target_include_directories(colmap SYSTEM INTERFACE ${SKEIN_COLMAP_DIR}/include/skein_colmap)
set(SKEIN_COLMAP_VERSION 308)
if(EXISTS ${SKEIN_COLMAP_DIR}/include/skein_colmap/colmap/scene/camera.h)
  set(SKEIN_COLMAP_VERSION 310)
endif()
target_compile_definitions(colmap INTERFACE SKEIN_COLMAP_VERSION=${SKEIN_COLMAP_VERSION} GLOG_NO_ABBREVIATED_SEVERITIES)
if(SKEIN_SANITIZE)
  # Under AddressSanitizer Eigen would allocate otherwise than in COLMAP's library, which is built
  # without, and each would free the other's memory.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
target_link_libraries(colmap INTERFACE Ceres::ceres Eigen3::Eigen
  Boost::filesystem Boost::system SQLite::SQLite3 ${GLOG_LIBRARY} Threads::Threads)

if(SKEIN_TESTS)
  find_package(GTest REQUIRED)
endif()
if(SKEIN_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
