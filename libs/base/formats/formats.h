#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/local_descriptor.h"
#include "core/result.h"

// Contents of blobs. Every encoding starts with a four-letter identifier and a uint32 version, is
// little endian, and has one valid byte sequence for a value. Decoding checks identifier, version
// and every count against the bytes. Bytes left over are an error. Pixels are full-resolution
// pixels of the photo as stored, flipped left to right if that is a mirror image (photo/exif.h);
// the centre of the upper-left pixel is (0.5, 0.5).
namespace skein {

struct Keypoint {
  float x = 0, y = 0;  // pixels
  float scale_px = 0;
  float angle_rad = 0;
  uint8_t r = 0, g = 0, b = 0;
};
using Keypoints = std::vector<Keypoint>;

Bytes EncodeKeypoints(const Keypoints& keypoints);
Result<Keypoints> DecodeKeypoints(const Bytes& bytes);

// N x 128, row major; row i describes keypoint i.
struct Descriptors {
  static constexpr size_t kDim = kDescriptorDim;
  std::vector<uint8_t> data;

  size_t rows() const { return data.size() / kDim; }
  const uint8_t* row(size_t i) const { return data.data() + i * kDim; }
};

Bytes EncodeDescriptors(const Descriptors& descriptors);  // throws if data is no multiple of kDim
Result<Descriptors> DecodeDescriptors(const Bytes& bytes);

// NetVLAD has 32,768 values, the largest in use. An index is of the size that its first photo has.
inline constexpr uint32_t kMaxGlobalDescriptorValues = 1 << 16;

// One L2-normalised vector; those of two models must never be compared.
struct GlobalDescriptor {
  std::string model;
  std::vector<float> values;
};

Bytes EncodeGlobalDescriptor(const GlobalDescriptor& descriptor);
Result<GlobalDescriptor> DecodeGlobalDescriptor(const Bytes& bytes);

// A verified pair: this image against `other_id`. Matrices are row major and map this image to the
// other: x_other^T E x_this = 0, x_other ~ H x_this. An unset matrix is zero.
struct TwoViewPair {
  int64_t other_id = 0;
  int8_t geometry = 0;  // TwoViewGeometry::ConfigurationType
  std::array<double, 9> E{}, F{}, H{};
  std::array<double, 4> qvec{1, 0, 0, 0};              // other_from_this, wxyz
  std::array<double, 3> tvec{};                        // other_from_this, unit length or zero
  float tri_angle_rad = 0;                             // median triangulation angle
  float forward_motion = 0;                            // |z| of the unit translation, 0..1
  std::vector<std::pair<uint32_t, uint32_t>> inliers;  // keypoint of this image, of the other
};
using TwoViewPairs = std::vector<TwoViewPair>;

Bytes EncodeTwoViewPairs(const TwoViewPairs& pairs);
Result<TwoViewPairs> DecodeTwoViewPairs(const Bytes& bytes);

// The files of a model by name: cameras.bin, images.bin, points3D.bin, state.bin. A blob holds them
// in the order of their names.
using ModelArchive = std::map<std::string, Bytes>;

Bytes EncodeModelArchive(const ModelArchive& archive);
Result<ModelArchive> DecodeModelArchive(const Bytes& bytes);

// An image that two submaps hold, as the merger needs it.
struct SharedPoint {
  uint32_t point2D_idx = 0;     // keypoint index
  std::array<double, 3> xyz{};  // in the frame of the submap
  float u = 0, v = 0;           // pixels
};

struct SharedImage {
  int64_t image_id = 0;
  int32_t camera_model_id = 0;  // COLMAP's
  std::vector<double> params;
  uint64_t width = 0, height = 0;
  std::array<double, 4> qvec{1, 0, 0, 0};  // cam_from_world, wxyz
  std::array<double, 3> tvec{};
  std::vector<SharedPoint> points;  // keypoints that have a 3D point
};
using SharedImages = std::vector<SharedImage>;

Bytes EncodeSharedImages(const SharedImages& images);
Result<SharedImages> DecodeSharedImages(const Bytes& bytes);

}  // namespace skein
