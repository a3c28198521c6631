#include "export/points_ply.h"

#include <string>

#include "core/file.h"
#include "core/ply.h"

namespace skein {

Status WritePointsPly(const Reconstruction& model, const std::filesystem::path& file) {
  constexpr size_t kVertexBytes = 3 * sizeof(float) + 3;
  std::string ply = PlyHeader(model.NumPoints3D(), false) + "end_header\n";
  ply.reserve(ply.size() + kVertexBytes * model.NumPoints3D());
  for (const auto& [id, point] : model.Points3D()) {
    const Eigen::Vector3f xyz = point.XYZ().cast<float>();
    ply.append(reinterpret_cast<const char*>(xyz.data()), sizeof(xyz));
    ply.append(reinterpret_cast<const char*>(point.Color().data()), 3);
  }
  return WriteFileAtomic(file.string(), ply);
}

}  // namespace skein
