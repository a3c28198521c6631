#include "benchmark/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace skein {
namespace {

struct PlyHeader {
  size_t num_vertices = 0, num_faces = 0;
};

PlyHeader ReadHeader(std::istream& in, const std::string& file) {
  PlyHeader header;
  std::string line;
  bool ascii = false;
  while (std::getline(in, line) && line != "end_header") {
    ascii |= line == "format ascii 1.0";
    if (line.rfind("element vertex ", 0) == 0) header.num_vertices = std::stoul(line.substr(15));
    if (line.rfind("element face ", 0) == 0) header.num_faces = std::stoul(line.substr(13));
  }
  if (!ascii || header.num_faces == 0) throw std::runtime_error(file + ": no ASCII PLY with faces");
  return header;
}

double DistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

double DistanceToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return normal.cross(to - from).dot(p - from) >= 0;
  };
  if (normal.squaredNorm() > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    return std::abs(normal.dot(p - a)) / normal.norm();
  }
  return std::min(
      {DistanceToSegment(p, a, b), DistanceToSegment(p, b, c), DistanceToSegment(p, c, a)});
}

}  // namespace

SurfaceDistance::SurfaceDistance(const std::string& file) {
  std::ifstream in(file);
  const PlyHeader header = ReadHeader(in, file);
  std::vector<Eigen::Vector3d> vertices(header.num_vertices);
  for (Eigen::Vector3d& v : vertices) in >> v.x() >> v.y() >> v.z();
  for (size_t i = 0; i < header.num_faces; ++i) {
    size_t num_corners = 0;
    in >> num_corners;
    if (!in || num_corners < 3 || num_corners > 64) throw std::runtime_error(file + ": damaged");
    std::vector<Eigen::Vector3d> corners;
    for (size_t k = 0, index = 0; k < num_corners; ++k) {
      in >> index;
      if (!in || index >= vertices.size()) throw std::runtime_error(file + ": damaged");
      corners.push_back(vertices[index]);
    }
    AddFace(corners);
  }
}

void SurfaceDistance::AddFace(const std::vector<Eigen::Vector3d>& corners) {
  for (size_t k = 2; k < corners.size(); ++k) {
    Triangle triangle{corners[0], corners[k - 1], corners[k], {}};
    for (const Eigen::Vector3d& corner : {triangle.a, triangle.b, triangle.c}) {
      triangle.box.extend(corner);
    }
    triangles_.push_back(triangle);
  }
}

double SurfaceDistance::operator()(const Eigen::Vector3d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Triangle& triangle : triangles_) {
    if (triangle.box.exteriorDistance(point) >= nearest) continue;
    nearest = std::min(nearest, DistanceToTriangle(point, triangle.a, triangle.b, triangle.c));
  }
  return nearest;
}

}  // namespace skein
