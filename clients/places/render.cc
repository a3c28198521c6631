#include "clients/places/render.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace skein::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kGrainLevel = 0.7f;  // above this level of the texture its grain is not seen
constexpr int kEdgeSamples = 3;      // rays a side of an edge pixel
constexpr float kSkyDistance = 1e5f;
constexpr int kMaxTaps = 4;  // along the long axis of a sample's footprint

class Renderer {
 public:
  Renderer(const Place& place, const Camera& camera, const View& view)
      : place_(place),
        camera_(camera),
        view_(view),
        undistort_(camera),
        pixel_angle_(static_cast<float>(1 / camera.focal_px)),
        patch_(camera.height, camera.width),
        lighting_(camera.height, camera.width, 0.0f) {
    for (int y = 0; y < camera.height; ++y) rows_.emplace_back(RowPose(y, 0));
  }

  cv::Mat3f Render() {
    cv::Mat3f image(camera_.height, camera_.width);
    TraceCenters();
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        const Vector3f color = Uniform(x, y) ? ShadeInside(x, y) : ShadeEdge(x, y);
        image(y, x) = cv::Vec3f(color.x(), color.y(), color.z());
      }
    }
    return image;
  }

  // How far each pixel's point moves in the photo while its row is exposed. After Render.
  cv::Mat2f ImageMotion() const {
    cv::Mat2f motion(camera_.height, camera_.width, cv::Vec2f(0, 0));
    for (int y = 0; y < camera_.height; ++y) {
      const double half_s = view_.shutter.exposure_s / 2;
      const Pose begin = RowPose(y, -half_s), end = RowPose(y, half_s);
      for (int x = 0; x < camera_.width; ++x) {
        const Ray3 ray = Ray(x + 0.5f, y + 0.5f);
        const int index = patch_(y, x);
        const float t = index < 0 ? kSkyDistance : Distance(place_.scene.surface(index), ray);
        const Eigen::Vector3d point = (ray.origin + t * ray.direction).cast<double>();
        Eigen::Vector2d from, to;
        Project(camera_, begin, point, &from);
        Project(camera_, end, point, &to);
        motion(y, x) = cv::Vec2f(to.x() - from.x(), to.y() - from.y());
      }
    }
    return motion;
  }

 private:
  struct Ray3 {
    Vector3f origin, direction;
  };
  // Where the camera is while a row is exposed.
  struct Row {
    Eigen::Matrix3f world_from_cam;
    Vector3f center;

    explicit Row(const Pose& pose)
        : world_from_cam(pose.cam_from_world.conjugate().toRotationMatrix().cast<float>()),
          center(pose.center.cast<float>()) {}
  };

  Pose RowPose(int y, double offset_s) const {
    const double delay_s = view_.shutter.RowDelay(y + 0.5, camera_.height);
    return PoseAfter(view_.pose, view_.motion, delay_s + offset_s);
  }

  Ray3 Ray(float x_px, float y_px) const {
    const Vector2f uv = undistort_(x_px, y_px);
    const Row& row = rows_[static_cast<int>(y_px)];
    return {row.center, row.world_from_cam * Vector3f(uv.x(), uv.y(), 1)};
  }

  static float Distance(const PreparedSurface& s, const Ray3& ray) {
    return s.normal.dot(s.origin - ray.origin) / s.normal.dot(ray.direction);
  }

  // Every other pixel of every other row is traced. A pixel between four that see one surface sees
  // it, too. Structures below two pixels may be lost there.
  void TraceCenters() {
    for (int y = 0; y < camera_.height; y += 2) {
      for (int x = 0; x < camera_.width; x += 2) TraceCenter(x, y);
    }
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = y % 2 == 0 ? 1 : 0; x < camera_.width; x += y % 2 == 0 ? 2 : 1) {
        if (!InferCenter(x, y)) TraceCenter(x, y);
      }
    }
  }

  void TraceCenter(int x, int y) {
    const Ray3 ray = Ray(x + 0.5f, y + 0.5f);
    const int index = place_.scene.Trace(ray.origin, ray.direction).surface;
    patch_(y, x) = index < 0 ? -1 : place_.scene.surface(index).patch;
    if (index < 0) return;
    const PreparedSurface& s = place_.scene.surface(index);
    lighting_(y, x) = Lighting(s, TexturePosition(s, ray), ray.origin);
  }

  bool InferCenter(int x, int y) {
    const int x0 = x & ~1, y0 = y & ~1, x1 = x0 + 2, y1 = y0 + 2;
    if (x1 >= camera_.width || y1 >= camera_.height) return false;
    const int surface = patch_(y0, x0);
    if (patch_(y0, x1) != surface || patch_(y1, x0) != surface || patch_(y1, x1) != surface) {
      return false;
    }
    const float light = lighting_(y0, x0);
    if (lighting_(y0, x1) != light || lighting_(y1, x0) != light || lighting_(y1, x1) != light) {
      return false;  // a shadow's edge
    }
    patch_(y, x) = surface;
    lighting_(y, x) = light;
    return true;
  }

  bool Uniform(int x, int y) const {
    const int here = patch_(y, x);
    return x > 0 && y > 0 && x + 1 < camera_.width && y + 1 < camera_.height &&
           patch_(y, x - 1) == here && patch_(y, x + 1) == here && patch_(y - 1, x) == here &&
           patch_(y + 1, x) == here;
  }

  static Vector3f Sky(const Vector3f& direction) {
    const float height = std::clamp(direction.normalized().z(), 0.0f, 1.0f);
    return Vector3f(238, 228, 218) + height * (Vector3f(215, 160, 110) - Vector3f(238, 228, 218));
  }

  static Vector2f TexturePosition(const PreparedSurface& s, const Ray3& ray) {
    const Vector3f offset = ray.origin + Distance(s, ray) * ray.direction - s.origin;
    return {offset.dot(s.u_axis), offset.dot(s.v_axis)};
  }

  float Lighting(const PreparedSurface& s, const Vector2f& uv, const Vector3f& eye) const {
    const Vector3f point = s.origin + uv.x() * s.u_axis + uv.y() * s.v_axis;
    const Vector3f normal = s.normal.dot(eye - point) < 0 ? Vector3f(-s.normal) : s.normal;
    const Light& light = place_.light;
    if (light.indoors) return light.ambient * (0.9f + 0.1f * normal.z() + 0.07f * normal.x());
    const float sky = light.ambient * (0.85f + 0.15f * normal.z());
    const float facing = normal.dot(light.sun_direction);
    if (facing <= 0) return sky;
    const bool shadow = place_.scene.Occluded(point + 2e-3f * normal, light.sun_direction, 1e4f);
    return shadow ? sky : sky + light.sun * facing;
  }

  Vector3f Albedo(const PreparedSurface& s, const Vector2f& uv, float footprint_m) const {
    const Texture& texture = place_.textures[s.surface.texture];
    const Vector2f at = s.surface.uv + uv;
    const float level = texture.Level(footprint_m);
    Vector3f color = texture.Sample(at.x(), at.y(), level).cwiseProduct(s.surface.tint);
    if (level < kGrainLevel) {
      const Texture& grain = place_.grain[0];
      const float shift = place_.grain_shift_m[s.surface.texture];
      const Vector3f fine = grain.Sample(at.x() + shift, at.y() - shift, grain.Level(footprint_m));
      const float strength = s.surface.detail * std::min(1.0f, kGrainLevel - level) / 128;
      color.array() *= 1 + strength * (fine.array() - 128);
    }
    return color;
  }

  // One surface fills the pixel: no more rays, only its texture.
  Vector3f ShadeInside(int x, int y) const {
    const int index = patch_(y, x);
    if (index < 0) return Sky(Ray(x + 0.5f, y + 0.5f).direction);
    const PreparedSurface& s = place_.scene.surface(index);
    Vector2f uv[2][2];
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        uv[j][i] = TexturePosition(s, Ray(x + 0.25f + 0.5f * i, y + 0.25f + 0.5f * j));
      }
    }
    const Vector2f dx = uv[0][1] - uv[0][0], dy = uv[1][0] - uv[0][0];
    const bool wide = dx.squaredNorm() > dy.squaredNorm();
    const Vector2f& major = wide ? dx : dy;
    const float minor_m = std::max((wide ? dy : dx).norm(), 1e-6f);
    const int taps = std::clamp(static_cast<int>(std::lround(major.norm() / minor_m)), 1, kMaxTaps);
    const float footprint_m = std::max(minor_m, major.norm() / taps);
    Vector3f sum = Vector3f::Zero();
    for (const auto& row : uv) {
      for (const Vector2f& at : row) {
        for (int k = 0; k < taps; ++k) {
          const float along = (k + 0.5f) / taps - 0.5f;
          sum += Albedo(s, at + along * major, footprint_m);
        }
      }
    }
    // Over the neighbours, which see the same surface: shadows get smooth edges.
    const float light =
        lighting_(y, x) / 2 +
        (lighting_(y, x - 1) + lighting_(y, x + 1) + lighting_(y - 1, x) + lighting_(y + 1, x)) / 8;
    return sum * (light / (4 * taps));
  }

  Vector3f ShadeEdge(int x, int y) const {
    Vector3f sum = Vector3f::Zero();
    LitPatch lit;
    for (int j = 0; j < kEdgeSamples; ++j) {
      for (int i = 0; i < kEdgeSamples; ++i) {
        sum += ShadeRay(Ray(x + (i + 0.5f) / kEdgeSamples, y + (j + 0.5f) / kEdgeSamples), &lit);
      }
    }
    return sum / (kEdgeSamples * kEdgeSamples);
  }

  // The light on a patch within one pixel, kept between the pixel's rays.
  struct LitPatch {
    int patch = -1;
    float light = 0;
  };

  Vector3f ShadeRay(const Ray3& ray, LitPatch* lit) const {
    const Hit hit = place_.scene.Trace(ray.origin, ray.direction);
    if (hit.surface < 0) return Sky(ray.direction);
    const PreparedSurface& s = place_.scene.surface(hit.surface);
    const Vector2f uv = TexturePosition(s, ray);
    if (lit->patch != s.patch) *lit = {s.patch, Lighting(s, uv, ray.origin)};
    const float cosine = std::abs(s.normal.dot(ray.direction)) / ray.direction.norm();
    const float footprint_m =
        hit.t * pixel_angle_ / kEdgeSamples / std::sqrt(std::max(cosine, 0.05f));
    return Albedo(s, uv, footprint_m) * lit->light;
  }

  const Place& place_;
  const Camera& camera_;
  const View& view_;
  const Undistorter undistort_;
  std::vector<Row> rows_;
  const float pixel_angle_;
  cv::Mat1i patch_;     // seen at each pixel's centre
  cv::Mat1f lighting_;  // there
};

}  // namespace

cv::Mat3f RenderLight(const Place& place, const Camera& camera, const View& view) {
  Renderer renderer(place, camera, view);
  const cv::Mat3f light = renderer.Render();
  if (view.shutter.exposure_s <= 0) return light;
  return BlurAlong(light, renderer.ImageMotion());
}

cv::Mat3b RenderPhoto(const Place& place, const Camera& camera, const Pose& pose,
                      const Exposure& exposure) {
  return Expose(RenderLight(place, camera, {pose, {}, {}}), exposure);
}

}  // namespace skein::sim
