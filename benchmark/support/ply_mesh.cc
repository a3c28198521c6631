#include "benchmark/support/ply_mesh.h"

#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace skein {
namespace {

constexpr std::streamsize kXyzBytes = 3 * sizeof(float);

struct Header {
  std::string format;
  size_t num_vertices = 0, num_faces = 0;
  std::streamsize vertex_bytes = 0;

  bool IsAscii() const { return format == "ascii"; }
};

Header ReadHeader(std::istream& in) {
  Header header;
  std::string line;
  while (std::getline(in, line) && line != "end_header") {
    std::istringstream words(line);
    std::string first, second;
    words >> first >> second;
    if (first == "format") header.format = second;
    if (first == "element") words >> (second == "face" ? header.num_faces : header.num_vertices);
    if (first == "property" && second == "float") header.vertex_bytes += sizeof(float);
    if (first == "property" && second == "uchar") header.vertex_bytes += sizeof(uint8_t);
  }
  const bool is_known = header.IsAscii() || header.format == "binary_little_endian";
  if (!is_known || header.vertex_bytes < kXyzBytes) in.setstate(std::ios::failbit);
  return header;
}

// The next number, a T in a binary file.
template <typename T>
double Next(const Header& header, std::istream& in) {
  double number = 0;
  if (header.IsAscii()) {
    in >> number;
    return number;
  }
  T stored{};
  in.read(reinterpret_cast<char*>(&stored), sizeof stored);
  return stored;
}

Eigen::Vector3d ReadVertex(const Header& header, std::istream& in) {
  Eigen::Vector3d vertex;
  for (int i = 0; i < 3; ++i) vertex[i] = Next<float>(header, in);
  if (header.IsAscii()) {
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  } else {
    in.ignore(header.vertex_bytes - kXyzBytes);
  }
  return vertex;
}

std::vector<uint32_t> ReadFace(const Header& header, std::istream& in) {
  constexpr double kMostCorners = 64;
  std::vector<uint32_t> face;
  const double count = Next<uint8_t>(header, in);
  if (!(count >= 3 && count <= kMostCorners)) in.setstate(std::ios::failbit);
  while (in && static_cast<double>(face.size()) < count) {
    const double index = Next<int32_t>(header, in);
    if (!(index >= 0 && index < static_cast<double>(header.num_vertices))) {
      in.setstate(std::ios::failbit);
      break;
    }
    face.push_back(static_cast<uint32_t>(index));
  }
  return face;
}

}  // namespace

PlyMesh ReadPlyMesh(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  const Header header = ReadHeader(in);
  PlyMesh mesh;
  for (size_t i = 0; in && i < header.num_vertices; ++i) {
    mesh.vertices.push_back(ReadVertex(header, in));
  }
  for (size_t i = 0; in && i < header.num_faces; ++i) mesh.faces.push_back(ReadFace(header, in));
  if (!in) throw std::runtime_error(file + ": not a whole PLY file of Skein");
  return mesh;
}

}  // namespace skein
