// The files of mesh_files.h, read by readers after the formats' own documentation, which share no
// code with the writers.
#include "texture/mesh_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>

#include "surface/model_mesh.h"
#include "testing/wall_maps.h"

namespace skein::surface_test {
namespace {

using nlohmann::json;

struct ReadMesh {
  std::vector<Eigen::Vector3d> positions, normals;
  std::vector<std::array<double, 3>> colours;  // as stored
  std::vector<Eigen::Vector2f> places;         // in a texture
  std::vector<int64_t> indices;
};

template <typename T>
T ReadAt(const std::string& bytes, size_t at) {
  T value{};
  if (at + sizeof(T) > bytes.size()) throw std::out_of_range("file is cut short");
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

Eigen::Vector3d ReadVector(const std::string& bytes, size_t at) {
  return {ReadAt<float>(bytes, at), ReadAt<float>(bytes, at + 4), ReadAt<float>(bytes, at + 8)};
}

// The file has the properties in the order that mesh_files.h names.
ReadMesh ReadPly(const std::string& ply) {
  const std::string end = "end_header\n";
  size_t at = ply.find(end) + end.size();
  std::istringstream header(ply.substr(0, at));
  std::string line, properties;
  size_t num_vertices = 0, num_faces = 0;
  while (std::getline(header, line)) {
    std::istringstream words(line);
    std::string first, name;
    words >> first >> name;
    if (first == "element") words >> (name == "vertex" ? num_vertices : num_faces);
    if (first == "property") properties += line.substr(line.rfind(' '));
  }
  EXPECT_EQ(properties, " x y z nx ny nz red green blue vertex_indices");
  ReadMesh mesh;
  for (size_t i = 0; i < num_vertices; ++i, at += 27) {
    mesh.positions.push_back(ReadVector(ply, at));
    mesh.normals.push_back(ReadVector(ply, at + 12));
    mesh.colours.push_back({static_cast<double>(ReadAt<uint8_t>(ply, at + 24)),
                            static_cast<double>(ReadAt<uint8_t>(ply, at + 25)),
                            static_cast<double>(ReadAt<uint8_t>(ply, at + 26))});
  }
  for (size_t i = 0; i < num_faces; ++i, at += 13) {
    EXPECT_EQ(ReadAt<uint8_t>(ply, at), 3);
    for (size_t k = 0; k < 3; ++k) mesh.indices.push_back(ReadAt<int32_t>(ply, at + 1 + 4 * k));
  }
  EXPECT_EQ(at, ply.size());
  return mesh;
}

class GlbReader {
 public:
  explicit GlbReader(const std::string& glb) : glb_(glb) {
    EXPECT_EQ(glb.substr(0, 4), "glTF");
    EXPECT_EQ(ReadAt<uint32_t>(glb, 4), 2U);
    EXPECT_EQ(ReadAt<uint32_t>(glb, 8), glb.size());
    const uint32_t json_size = ReadAt<uint32_t>(glb, 12);
    EXPECT_EQ(json_size % 4, 0U);
    EXPECT_EQ(glb.substr(16, 4), "JSON");
    gltf = json::parse(glb.substr(20, json_size));
    binary_ = 20 + json_size + 8;
    EXPECT_EQ(glb.substr(binary_ - 4, 4), std::string("BIN\0", 4));
    EXPECT_EQ(ReadAt<uint32_t>(glb, binary_ - 8), glb.size() - binary_);
    EXPECT_EQ(gltf["buffers"][0]["byteLength"], glb.size() - binary_);
  }

  ReadMesh Read(size_t part = 0) const {
    const json& primitive = gltf["meshes"][0]["primitives"][part];
    const json& attributes = primitive["attributes"];
    ReadMesh mesh;
    const auto& t = gltf["nodes"][0]["translation"];
    const Eigen::Vector3d translation(t[0], t[1], t[2]);
    ForEach(attributes["POSITION"], 5126, "VEC3", 12,
            [&](size_t at) { mesh.positions.push_back(translation + ReadVector(glb_, at)); });
    ForEach(attributes["NORMAL"], 5126, "VEC3", 12,
            [&](size_t at) { mesh.normals.push_back(ReadVector(glb_, at)); });
    if (attributes.contains("COLOR_0")) {
      ForEach(attributes["COLOR_0"], 5123, "VEC4", 8, [&](size_t at) {
        mesh.colours.push_back({ReadAt<uint16_t>(glb_, at) / 65535.0,
                                ReadAt<uint16_t>(glb_, at + 2) / 65535.0,
                                ReadAt<uint16_t>(glb_, at + 4) / 65535.0});
      });
    }
    if (attributes.contains("TEXCOORD_0")) {
      ForEach(attributes["TEXCOORD_0"], 5126, "VEC2", 8, [&](size_t at) {
        mesh.places.emplace_back(ReadAt<float>(glb_, at), ReadAt<float>(glb_, at + 4));
      });
    }
    ForEach(primitive["indices"], 5125, "SCALAR", 4,
            [&](size_t at) { mesh.indices.push_back(ReadAt<uint32_t>(glb_, at)); });
    return mesh;
  }

  // The texture of a part, as a decoder of JPEG reads it.
  cv::Mat3b Texture(size_t part) const {
    const json& primitive = gltf["meshes"][0]["primitives"][part];
    const json& material = gltf["materials"][primitive["material"].get<size_t>()];
    const json& texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
    const json& source = gltf["textures"][texture.get<size_t>()]["source"];
    const json& image = gltf["images"][source.get<size_t>()];
    EXPECT_EQ(image["mimeType"], "image/jpeg");
    const json& view = gltf["bufferViews"][image["bufferView"].get<size_t>()];
    const auto begin =
        glb_.begin() + static_cast<ptrdiff_t>(binary_ + view["byteOffset"].get<size_t>());
    const std::vector<uint8_t> jpeg(begin, begin + view["byteLength"].get<ptrdiff_t>());
    return cv::imdecode(jpeg, cv::IMREAD_COLOR);
  }

  json gltf;

 private:
  template <typename Function>
  void ForEach(const json& number, int component, const std::string& type, size_t bytes,
               const Function& function) const {
    const json& accessor = gltf["accessors"][number.get<size_t>()];
    EXPECT_EQ(accessor["componentType"], component);
    EXPECT_EQ(accessor["type"], type);
    const json& view = gltf["bufferViews"][accessor["bufferView"].get<size_t>()];
    const size_t begin = view["byteOffset"], count = accessor["count"];
    EXPECT_EQ(view["byteLength"], count * bytes);
    EXPECT_EQ(begin % 4, 0U);
    for (size_t i = 0; i < count; ++i) function(binary_ + begin + i * bytes);
  }

  const std::string& glb_;
  size_t binary_ = 0;
};

// All triangles with the colours of their vertices.
std::vector<MeshPart> WithoutTexture(const SurfaceMesh& mesh) {
  MeshPart part;
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) part.vertices.push_back(i);
  part.indices = mesh.indices;
  return {part};
}

std::string Glb(const SurfaceMesh& mesh, bool z_up) {
  return MeshGlb(mesh, WithoutTexture(mesh), z_up);
}

void ExpectIndicesInRange(const ReadMesh& mesh) {
  ASSERT_EQ(mesh.indices.size() % 3, 0U);
  for (const int64_t index : mesh.indices) {
    ASSERT_GE(index, 0);
    ASSERT_LT(index, static_cast<int64_t>(mesh.positions.size()));
  }
}

// Two triangles at z = 50, seen from above.
SurfaceMesh Square() {
  SurfaceMesh mesh;
  mesh.origin = {100000.25, 200000.5, 50};
  for (const auto& [x, y] : {std::pair{0, 0}, {2, 0}, {2, 1}, {0, 1}}) {
    mesh.vertices.push_back({Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 0),
                             Eigen::Vector3f::UnitZ(),
                             {255, 128, 0}});
  }
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

const ModelMesh& WallMesh() {
  static const ModelMesh mesh = [] {
    const WallMap a(PoseAt({0, 0, 0})), b(PoseAt({1.3, 0.4, 0.2}));
    return *MakeModelMesh({a.Coloured(), b.Coloured()}, MeshOptions());
  }();
  return mesh;
}

TEST(MeshFiles, PlyHoldsTheWall) {
  const ReadMesh read = ReadPly(MeshPly(WallMesh().mesh));
  ASSERT_EQ(read.positions.size(), WallMesh().mesh.vertices.size());
  ASSERT_EQ(read.indices.size(), WallMesh().mesh.indices.size());
  ExpectIndicesInRange(read);
  for (size_t i = 0; i < read.positions.size(); ++i) {
    ASSERT_LT(DistanceFromWall(read.positions[i]), WallMesh().voxel);
    ASSERT_GT(read.normals[i].dot(WallNormal()), 0.8);
    ASSERT_EQ(read.colours[i], (std::array<double, 3>{30, 20, 10}));
  }
}

TEST(MeshFiles, GlbHoldsTheWall) {
  const std::string glb = Glb(WallMesh().mesh, false);
  const GlbReader reader(glb);
  const ReadMesh read = reader.Read();
  ASSERT_EQ(read.positions.size(), WallMesh().mesh.vertices.size());
  ASSERT_EQ(read.indices.size(), WallMesh().mesh.indices.size());
  ExpectIndicesInRange(read);
  Eigen::Vector3d low = read.positions[0], high = low;
  for (size_t i = 0; i < read.positions.size(); ++i) {
    ASSERT_LT(DistanceFromWall(read.positions[i]), WallMesh().voxel);
    ASSERT_GT(read.normals[i].dot(WallNormal()), 0.8);
    low = low.cwiseMin(read.positions[i]);
    high = high.cwiseMax(read.positions[i]);
  }
  EXPECT_GT(high.x() - low.x(), 10);
  EXPECT_LT(high.x() - low.x(), 16);
  const json& accessor = reader.gltf["accessors"][0];
  for (int i = 0; i < 3; ++i) {
    const double shift = reader.gltf["nodes"][0]["translation"][i];
    EXPECT_NEAR(accessor["min"][i].get<double>() + shift, low[i], 1e-5);
    EXPECT_NEAR(accessor["max"][i].get<double>() + shift, high[i], 1e-5);
  }
}

TEST(MeshFiles, GlbHasYUpWhereTheFrameHasZUp) {
  const std::string turned = Glb(Square(), true), plain = Glb(Square(), false);
  const ReadMesh up = GlbReader(turned).Read(), as_is = GlbReader(plain).Read();
  EXPECT_EQ(up.positions[2], Eigen::Vector3d(100002.25, 50, -200001.5));
  EXPECT_EQ(up.normals[2], Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(as_is.positions[2], Eigen::Vector3d(100002.25, 200001.5, 50));
}

TEST(MeshFiles, GlbHasLinearColours) {
  const std::string glb = Glb(Square(), true);
  const std::array<double, 3> colour = GlbReader(glb).Read().colours[0];
  EXPECT_EQ(colour[0], 1);
  EXPECT_NEAR(colour[1], 0.2158, 1e-4);
  EXPECT_EQ(colour[2], 0);
}

TEST(MeshFiles, PlyIsInTheFrameOfTheMaps) {
  const ReadMesh read = ReadPly(MeshPly(Square()));
  EXPECT_NEAR((read.positions[2] - Eigen::Vector3d(100002.25, 200001.5, 50)).norm(), 0, 0.02);
}

TEST(MeshFiles, GlbNeedsATriangle) {
  EXPECT_THROW(MeshGlb(SurfaceMesh(), {}, true), std::invalid_argument);
}

TEST(MeshFiles, GlbHoldsATextureAndTheRestOfTheTriangles) {
  MeshPart textured, rest;
  textured.texture = cv::Mat3b(5, 7, cv::Vec3b(10, 20, 200));  // 5 x 7: no multiple of four bytes
  textured.vertices = {0, 1, 2};
  textured.places = {{0, 1}, {1, 1}, {1, 0}};
  rest.vertices = {0, 2, 3};
  textured.indices = rest.indices = {0, 1, 2};
  const std::string glb = MeshGlb(Square(), {textured, rest}, false);
  const GlbReader reader(glb);
  const ReadMesh first = reader.Read(0), second = reader.Read(1);
  EXPECT_EQ(first.positions[1], Eigen::Vector3d(100002.25, 200000.5, 50));
  EXPECT_EQ(first.places, textured.places);
  EXPECT_TRUE(first.colours.empty()) << "glTF would multiply texture and colours";
  EXPECT_EQ(second.positions[2], Eigen::Vector3d(100000.25, 200001.5, 50));
  EXPECT_TRUE(second.places.empty());
  EXPECT_EQ(second.colours.size(), 3U);
  const cv::Mat3b texture = reader.Texture(0);
  ASSERT_EQ(texture.size(), textured.texture.size());
  EXPECT_LT(cv::norm(texture, textured.texture, cv::NORM_INF), 4);
}

}  // namespace
}  // namespace skein::surface_test
