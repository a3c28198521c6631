#include "texture/mesh_files.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "codecs/photo_encoding.h"
#include "core/ply.h"

namespace skein {
namespace {

using nlohmann::json;

template <typename T>
void Append(const T& value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void AppendVector(const Eigen::Vector3f& v, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(float));
}

// ---- glTF 2.0: numbers of the specification ----

constexpr uint32_t kGlbMagic = 0x46546C67, kGlbVersion = 2;  // "glTF"
constexpr uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963, kTriangles = 4;
constexpr int kLinear = 9729, kClampToEdge = 33071;  // filter and wrapping of a texture

// sRGB to linear light (IEC 61966-2-1), 16 bit.
std::array<uint16_t, 256> LinearLevels() {
  std::array<uint16_t, 256> levels{};
  for (int i = 0; i < 256; ++i) {
    const double s = i / 255.0;
    const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
    levels[i] = static_cast<uint16_t>(std::lround(65535 * linear));
  }
  return levels;
}

class Glb {
 public:
  Glb(const SurfaceMesh& mesh, bool z_up) : mesh_(mesh), z_up_(z_up) {}

  void Add(const MeshPart& part) {
    json attributes = {{"POSITION", AddPositions(part)}, {"NORMAL", AddNormals(part)}};
    if (part.texture.empty()) {
      attributes["COLOR_0"] = AddColours(part);
    } else {
      attributes["TEXCOORD_0"] = AddPlaces(part);
    }
    primitives_.push_back({{"attributes", attributes},
                           {"indices", AddIndices(part)},
                           {"material", AddMaterial(part.texture)},
                           {"mode", kTriangles}});
  }

  std::string File() const { return File(Description().dump()); }

 private:
  template <typename Vector>
  Vector Turned(const Vector& v) const {
    return z_up_ ? Vector(v.x(), v.z(), -v.y()) : v;
  }

  // The view covers the bytes that were added to the buffer since `begin`.
  size_t AddView(size_t begin) {
    const size_t size = buffer_.size() - begin;
    buffer_.resize((buffer_.size() + 3) / 4 * 4);  // the next one begins at a multiple of four
    views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", size}});
    return views_.size() - 1;
  }

  size_t AddAccessor(size_t begin, int target, json accessor) {
    accessor["bufferView"] = AddView(begin);
    views_.back()["target"] = target;
    accessors_.push_back(std::move(accessor));
    return accessors_.size() - 1;
  }

  size_t AddPositions(const MeshPart& part) {
    const size_t begin = buffer_.size();
    Eigen::AlignedBox3f box;
    for (const uint32_t vertex : part.vertices) {
      const Eigen::Vector3f position = Turned(mesh_.vertices[vertex].position);
      box.extend(position);
      AppendVector(position, &buffer_);
    }
    const Eigen::Vector3f &low = box.min(), &high = box.max();
    return AddAccessor(begin, kArrayBuffer,
                       {{"componentType", kFloat},
                        {"type", "VEC3"},
                        {"count", part.vertices.size()},
                        {"min", {low.x(), low.y(), low.z()}},
                        {"max", {high.x(), high.y(), high.z()}}});
  }

  size_t AddNormals(const MeshPart& part) {
    const size_t begin = buffer_.size();
    for (const uint32_t vertex : part.vertices) {
      AppendVector(Turned(mesh_.vertices[vertex].normal), &buffer_);
    }
    return AddAccessor(
        begin, kArrayBuffer,
        {{"componentType", kFloat}, {"type", "VEC3"}, {"count", part.vertices.size()}});
  }

  // With an alpha of 1, so that each vertex begins at a multiple of four bytes.
  size_t AddColours(const MeshPart& part) {
    static const std::array<uint16_t, 256> linear = LinearLevels();
    const size_t begin = buffer_.size();
    for (const uint32_t vertex : part.vertices) {
      for (const uint8_t channel : mesh_.vertices[vertex].colour) Append(linear[channel], &buffer_);
      Append(std::numeric_limits<uint16_t>::max(), &buffer_);
    }
    return AddAccessor(begin, kArrayBuffer,
                       {{"componentType", kUnsignedShort},
                        {"normalized", true},
                        {"type", "VEC4"},
                        {"count", part.vertices.size()}});
  }

  size_t AddPlaces(const MeshPart& part) {
    const size_t begin = buffer_.size();
    for (const Eigen::Vector2f& place : part.places) {
      Append(place.x(), &buffer_);
      Append(place.y(), &buffer_);
    }
    return AddAccessor(
        begin, kArrayBuffer,
        {{"componentType", kFloat}, {"type", "VEC2"}, {"count", part.places.size()}});
  }

  size_t AddIndices(const MeshPart& part) {
    const size_t begin = buffer_.size();
    buffer_.append(reinterpret_cast<const char*>(part.indices.data()),
                   part.indices.size() * sizeof(uint32_t));
    return AddAccessor(
        begin, kElementArrayBuffer,
        {{"componentType", kUnsignedInt}, {"type", "SCALAR"}, {"count", part.indices.size()}});
  }

  size_t AddMaterial(const cv::Mat3b& texture) {
    json surface = {{"metallicFactor", 0}};
    if (!texture.empty()) surface["baseColorTexture"] = {{"index", AddTexture(texture)}};
    materials_.push_back({{"doubleSided", true},
                          {"pbrMetallicRoughness", surface},
                          {"extensions", {{"KHR_materials_unlit", json::object()}}}});
    return materials_.size() - 1;
  }

  size_t AddTexture(const cv::Mat3b& texture) {
    const size_t begin = buffer_.size();
    const std::vector<uint8_t> jpeg = EncodePhoto(texture, nullptr, kJpegQuality);
    buffer_.append(jpeg.begin(), jpeg.end());
    images_.push_back({{"bufferView", AddView(begin)}, {"mimeType", "image/jpeg"}});
    textures_.push_back({{"source", images_.size() - 1}, {"sampler", 0}});
    return textures_.size() - 1;
  }

  json Description() const {
    const Eigen::Vector3d origin = Turned(mesh_.origin);
    const json node = {{"mesh", 0}, {"translation", {origin.x(), origin.y(), origin.z()}}};
    json description = {{"asset", {{"version", "2.0"}, {"generator", "Skein"}}},
                        {"extensionsUsed", json::array({"KHR_materials_unlit"})},
                        {"scene", 0},
                        {"scenes", json::array({{{"nodes", json::array({0})}}})},
                        {"nodes", json::array({node})},
                        {"meshes", json::array({{{"primitives", primitives_}}})},
                        {"materials", materials_},
                        {"accessors", accessors_},
                        {"bufferViews", views_},
                        {"buffers", json::array({{{"byteLength", buffer_.size()}}})}};
    if (!images_.empty()) {  // glTF has no empty arrays
      description["images"] = images_;
      description["textures"] = textures_;
      description["samplers"] = json::array({{{"magFilter", kLinear},
                                              {"minFilter", kLinear},
                                              {"wrapS", kClampToEdge},
                                              {"wrapT", kClampToEdge}}});
    }
    return description;
  }

  // Chunks end at multiples of four bytes: the JSON with blanks, the buffer by AddView.
  std::string File(std::string description) const {
    description.resize((description.size() + 3) / 4 * 4, ' ');
    const size_t size = 28 + description.size() + buffer_.size();  // 12, and 8 for each chunk
    if (size > std::numeric_limits<uint32_t>::max()) {
      throw std::invalid_argument("a binary glTF file has less than 4 GiB");
    }
    std::string file;
    file.reserve(size);
    for (const uint32_t word : {kGlbMagic, kGlbVersion, static_cast<uint32_t>(size),
                                static_cast<uint32_t>(description.size()), kJsonChunk}) {
      Append(word, &file);
    }
    file += description;
    Append(static_cast<uint32_t>(buffer_.size()), &file);
    Append(kBinaryChunk, &file);
    return file += buffer_;
  }

  const SurfaceMesh& mesh_;
  const bool z_up_;
  std::string buffer_;
  json primitives_ = json::array(), materials_ = json::array(), accessors_ = json::array();
  json views_ = json::array(), images_ = json::array(), textures_ = json::array();
};

}  // namespace

std::string MeshPly(const SurfaceMesh& mesh) {
  constexpr size_t kVertexBytes = 6 * sizeof(float) + 3, kFaceBytes = 1 + 3 * sizeof(uint32_t);
  constexpr uint8_t kCornersOfFace = 3;
  std::string ply = PlyHeader(mesh.vertices.size(), true) + "element face " +
                    std::to_string(mesh.NumTriangles()) +
                    "\nproperty list uchar int vertex_indices\nend_header\n";
  ply.reserve(ply.size() + kVertexBytes * mesh.vertices.size() +
              kFaceBytes * static_cast<size_t>(mesh.NumTriangles()));
  for (const MeshVertex& vertex : mesh.vertices) {
    AppendVector(mesh.Position(vertex).cast<float>(), &ply);
    AppendVector(vertex.normal, &ply);
    for (const uint8_t channel : vertex.colour) Append(channel, &ply);
  }
  for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    Append(kCornersOfFace, &ply);
    for (size_t k = 0; k < 3; ++k) Append(mesh.indices[i + k], &ply);
  }
  return ply;
}

std::string MeshGlb(const SurfaceMesh& mesh, const std::vector<MeshPart>& parts, bool z_up) {
  if (parts.empty()) throw std::invalid_argument("a mesh without triangles");
  Glb glb(mesh, z_up);
  for (const MeshPart& part : parts) glb.Add(part);
  return glb.File();
}

}  // namespace skein
