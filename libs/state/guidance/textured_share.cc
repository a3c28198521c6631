#include "guidance/textured_share.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <vector>

namespace skein {
namespace {

constexpr int kAcross = 5;  // places on a surfel, both ways
// Cells. A surfel lies at the mean of its points, up to half a cell from the middle of the cell
// that it stands for.
constexpr double kWidth = 1.5;

// A square: its middle and its sides.
struct Patch {
  Eigen::Vector3d middle, right, up;

  Patch SeenFrom(const CameraPose& cam_from_world) const {
    const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
    return {rotation * middle + cam_from_world.translation, rotation * right, rotation * up};
  }
};

Patch PatchOf(const Surfel& surfel, double cell) {
  const Eigen::Vector3d right = surfel.normal.unitOrthogonal();
  return {surfel.position, kWidth * cell * right, kWidth * cell * surfel.normal.cross(right)};
}

bool IsTextured(const TextureFields& texture, const GuidedCamera& camera,
                const Eigen::Vector2d& pixel) {
  const int column = static_cast<int>(pixel.x() * TextureFields::kColumns / camera.width_px);
  const int row = static_cast<int>(pixel.y() * TextureFields::kRows / camera.height_px);
  return texture.Has(std::min(column, TextureFields::kColumns - 1),
                     std::min(row, TextureFields::kRows - 1));
}

// Of the places that are in the photo.
double ShareIn(const GuidedPhoto& photo, const GuidedCamera& camera, const Patch& patch) {
  if (!photo.texture) return 1;
  const Patch seen = patch.SeenFrom(photo.cam_from_world);
  const auto along = [](int i) { return (i + 0.5) / kAcross - 0.5; };
  int shown = 0, textured = 0;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d place =
        seen.middle + along(i % kAcross) * seen.right + along(i / kAcross) * seen.up;
    if (!camera.Project(place, &pixel)) continue;
    ++shown;
    textured += IsTextured(*photo.texture, camera, pixel);
  }
  return shown == 0 ? 0 : static_cast<double>(textured) / shown;
}

}  // namespace

void TexturedShare::Add(const GuidedMap& map, const Surfel& surfel, double cell,
                        const std::vector<uint32_t>& photos) {
  const Patch patch = PatchOf(surfel, cell);
  for (const uint32_t index : photos) {
    // No photo shows more, and most surfels have as many that show all.
    if (best_.size() == kMinSurfelPhotos && best_.back() >= 1) return;
    const GuidedPhoto& photo = map.photos[index];
    const double share = ShareIn(photo, map.cameras[photo.camera], patch);
    best_.insert(std::upper_bound(best_.begin(), best_.end(), share, std::greater<>()), share);
    if (best_.size() > kMinSurfelPhotos) best_.pop_back();
  }
}

}  // namespace skein
