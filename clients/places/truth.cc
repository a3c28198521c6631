#include "clients/places/truth.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "clients/places/parallel.h"
#include "clients/places/random.h"

namespace skein::sim {
namespace {

constexpr int kPointsPerPhoto = 150, kLeastPointsPerPhoto = 10;
constexpr int kMaxPoints = 20000;  // where photos have more than the least

struct Observation {
  int photo;
  Eigen::Vector2d pixel;
};

struct TruePoint {
  Eigen::Vector3d position;
  std::vector<Observation> track;
};

bool Sees(const Place& place, const Camera& camera, const TruePhoto& photo,
          const Eigen::Vector3d& point, Eigen::Vector2d* pixel) {
  if (!Project(camera, photo.pose, point, pixel)) return false;
  const Eigen::Vector3f from = photo.pose.center.cast<float>();
  const Eigen::Vector3f ray = point.cast<float>() - from;
  return !place.scene.Occluded(from, ray, 1 - 1e-3f) && !photo.moving.Occluded(from, ray, 1);
}

std::vector<TruePoint> SamplePoints(const Place& place, const std::vector<Camera>& cameras,
                                    const std::vector<TruePhoto>& photos, int photo,
                                    uint64_t seed) {
  std::vector<TruePoint> points;
  const Pose& pose = photos[photo].pose;
  const Camera& camera = cameras[photos[photo].camera];
  const Undistorter undistort(camera);
  Random random = Random(seed).Fork(photo);
  const int count = std::clamp(kMaxPoints / static_cast<int>(photos.size()), kLeastPointsPerPhoto,
                               kPointsPerPhoto);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2f uv = undistort(static_cast<float>(random.Uniform(0, camera.width)),
                                         static_cast<float>(random.Uniform(0, camera.height)));
    const Eigen::Vector3d ray =
        pose.cam_from_world.conjugate() * Eigen::Vector3d(uv.x(), uv.y(), 1);
    const Hit hit = place.scene.Trace(pose.center.cast<float>(), ray.cast<float>());
    if (hit.surface < 0) continue;
    TruePoint point{pose.center + hit.t * ray, {}};
    for (int k = 0; k < static_cast<int>(photos.size()); ++k) {
      Eigen::Vector2d pixel;
      if (Sees(place, cameras[photos[k].camera], photos[k], point.position, &pixel)) {
        point.track.push_back({k, pixel});
      }
    }
    if (point.track.size() >= 2) points.push_back(point);
  }
  return points;
}

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

std::ostringstream ExactStream() {
  std::ostringstream out;
  out << std::setprecision(std::numeric_limits<double>::max_digits10);
  return out;
}

std::string CamerasText(const std::vector<Camera>& cameras) {
  std::ostringstream out = ExactStream();
  for (size_t i = 0; i < cameras.size(); ++i) {
    const Camera& c = cameras[i];
    out << i + 1 << " SIMPLE_RADIAL " << c.width << " " << c.height << " " << c.focal_px << " "
        << c.PrincipalPoint().x() << " " << c.PrincipalPoint().y() << " " << c.distortion << "\n";
  }
  return out.str();
}

std::vector<Eigen::Vector3f> Corners(const Surface& s) {
  if (s.shape == Surface::Shape::kGable) {
    return {s.origin + 0.5f * s.right, s.origin + s.down, s.origin + s.down + s.right};
  }
  return {s.origin, s.origin + s.down, s.origin + s.down + s.right, s.origin + s.right};
}

}  // namespace

void WriteTruth(const std::string& folder, const Place& place, const std::vector<Camera>& cameras,
                const std::vector<TruePhoto>& photos, uint64_t seed, int threads) {
  std::vector<std::vector<TruePoint>> sampled(photos.size());
  ParallelFor(static_cast<int>(photos.size()), threads,
              [&](int i) { sampled[i] = SamplePoints(place, cameras, photos, i, seed); });

  std::vector<std::string> observations(photos.size());
  std::vector<int> counts(photos.size(), 0);
  std::ostringstream points = ExactStream();
  int point_id = 0;
  for (const auto& of_photo : sampled) {
    for (const TruePoint& point : of_photo) {
      points << ++point_id << " " << point.position.x() << " " << point.position.y() << " "
             << point.position.z() << " 128 128 128 0";
      for (const Observation& o : point.track) {
        points << " " << o.photo + 1 << " " << counts[o.photo]++;
        char text[96];
        std::snprintf(text, sizeof text, "%.6f %.6f %d ", o.pixel.x(), o.pixel.y(), point_id);
        observations[o.photo] += text;
      }
      points << "\n";
    }
  }
  std::ostringstream images = ExactStream();
  for (size_t i = 0; i < photos.size(); ++i) {
    const Eigen::Quaterniond& q = photos[i].pose.cam_from_world;
    const Eigen::Vector3d t = photos[i].pose.Translation();
    images << i + 1 << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z() << " " << t.x()
           << " " << t.y() << " " << t.z() << " " << photos[i].camera + 1 << " " << photos[i].name
           << "\n"
           << observations[i] << "\n";
  }
  std::filesystem::create_directories(folder);
  WriteText(std::filesystem::path(folder) / "cameras.txt", CamerasText(cameras));
  WriteText(std::filesystem::path(folder) / "images.txt", images.str());
  WriteText(std::filesystem::path(folder) / "points3D.txt", points.str());
}

void WriteSurfaces(const std::string& file, const Scene& scene) {
  std::ostringstream vertices = ExactStream(), faces;
  int num_vertices = 0;
  for (int i = 0; i < scene.size(); ++i) {
    const std::vector<Eigen::Vector3f> corners = Corners(scene.surface(i).surface);
    faces << corners.size();
    for (const Eigen::Vector3f& corner : corners) {
      vertices << corner.x() << " " << corner.y() << " " << corner.z() << "\n";
      faces << " " << num_vertices++;
    }
    faces << "\n";
  }
  std::ostringstream header;
  header << "ply\nformat ascii 1.0\nelement vertex " << num_vertices
         << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << scene.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  WriteText(file, header.str() + vertices.str() + faces.str());
}

}  // namespace skein::sim
