#include "surface/mesh_files.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

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

  std::string Make() {
    AddPositions();
    AddNormals();
    AddColours();
    AddIndices();
    return File(Description().dump());
  }

 private:
  template <typename Vector>
  Vector Turned(const Vector& v) const {
    return z_up_ ? Vector(v.x(), v.z(), -v.y()) : v;
  }

  // The accessor covers the bytes that were added to the buffer since `begin`.
  void AddAccessor(size_t begin, int target, json accessor) {
    accessor["bufferView"] = views_.size();
    views_.push_back({{"buffer", 0},
                      {"byteOffset", begin},
                      {"byteLength", buffer_.size() - begin},
                      {"target", target}});
    accessors_.push_back(std::move(accessor));
  }

  void AddPositions() {
    const size_t begin = buffer_.size();
    Eigen::Vector3f low = Turned(mesh_.vertices[0].position), high = low;
    for (const MeshVertex& vertex : mesh_.vertices) {
      const Eigen::Vector3f position = Turned(vertex.position);
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
      AppendVector(position, &buffer_);
    }
    AddAccessor(begin, kArrayBuffer,
                {{"componentType", kFloat},
                 {"type", "VEC3"},
                 {"count", mesh_.vertices.size()},
                 {"min", {low.x(), low.y(), low.z()}},
                 {"max", {high.x(), high.y(), high.z()}}});
  }

  void AddNormals() {
    const size_t begin = buffer_.size();
    for (const MeshVertex& vertex : mesh_.vertices) AppendVector(Turned(vertex.normal), &buffer_);
    AddAccessor(begin, kArrayBuffer,
                {{"componentType", kFloat}, {"type", "VEC3"}, {"count", mesh_.vertices.size()}});
  }

  // With an alpha of 1, so that each vertex begins at a multiple of four bytes.
  void AddColours() {
    const std::array<uint16_t, 256> linear = LinearLevels();
    const size_t begin = buffer_.size();
    for (const MeshVertex& vertex : mesh_.vertices) {
      for (const uint8_t channel : vertex.colour) Append(linear[channel], &buffer_);
      Append(std::numeric_limits<uint16_t>::max(), &buffer_);
    }
    AddAccessor(begin, kArrayBuffer,
                {{"componentType", kUnsignedShort},
                 {"normalized", true},
                 {"type", "VEC4"},
                 {"count", mesh_.vertices.size()}});
  }

  void AddIndices() {
    const size_t begin = buffer_.size();
    buffer_.append(reinterpret_cast<const char*>(mesh_.indices.data()),
                   mesh_.indices.size() * sizeof(uint32_t));
    AddAccessor(
        begin, kElementArrayBuffer,
        {{"componentType", kUnsignedInt}, {"type", "SCALAR"}, {"count", mesh_.indices.size()}});
  }

  json Description() const {
    const json attributes = {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}};
    const json primitive = {
        {"attributes", attributes}, {"indices", 3}, {"material", 0}, {"mode", kTriangles}};
    const json material = {{"doubleSided", true},
                           {"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                           {"extensions", {{"KHR_materials_unlit", json::object()}}}};
    const Eigen::Vector3d origin = Turned(mesh_.origin);
    const json node = {{"mesh", 0}, {"translation", {origin.x(), origin.y(), origin.z()}}};
    return {{"asset", {{"version", "2.0"}, {"generator", "Skein"}}},
            {"extensionsUsed", json::array({"KHR_materials_unlit"})},
            {"scene", 0},
            {"scenes", json::array({{{"nodes", json::array({0})}}})},
            {"nodes", json::array({node})},
            {"meshes", json::array({{{"primitives", json::array({primitive})}}})},
            {"materials", json::array({material})},
            {"accessors", accessors_},
            {"bufferViews", views_},
            {"buffers", json::array({{{"byteLength", buffer_.size()}}})}};
  }

  // Chunks end at multiples of four bytes: the JSON with blanks, the buffer is of such parts alone.
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
  json accessors_ = json::array(), views_ = json::array();
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
    AppendVector((mesh.origin + vertex.position.cast<double>()).cast<float>(), &ply);
    AppendVector(vertex.normal, &ply);
    for (const uint8_t channel : vertex.colour) Append(channel, &ply);
  }
  for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    Append(kCornersOfFace, &ply);
    for (size_t k = 0; k < 3; ++k) Append(mesh.indices[i + k], &ply);
  }
  return ply;
}

std::string MeshGlb(const SurfaceMesh& mesh, bool z_up) {
  if (mesh.indices.empty()) throw std::invalid_argument("a mesh without triangles");
  return Glb(mesh, z_up).Make();
}

}  // namespace skein
