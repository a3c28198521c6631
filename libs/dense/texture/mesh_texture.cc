#include "texture/mesh_texture.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "texture/photo_gains.h"
#include "texture/triangle_photos.h"

namespace skein {
namespace {

constexpr int kBorderPx = 2;  // around a chart, of its texture, for filters of viewers

struct Chart {
  int32_t photo = 0;
  std::vector<size_t> triangles;
  cv::Rect box;    // in the photo
  cv::Rect place;  // on its page
  size_t page = 0;
};

// Connected triangles with one photo. Those without one are in no chart.
std::vector<Chart> ChartsOf(const std::vector<int32_t>& photos,
                            const std::vector<int32_t>& neighbours) {
  std::vector<Chart> charts;
  std::vector<bool> is_done(photos.size(), false);
  for (size_t first = 0; first < photos.size(); ++first) {
    if (is_done[first] || photos[first] < 0) continue;
    std::vector<size_t> triangles = {first};
    is_done[first] = true;
    for (size_t i = 0; i < triangles.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) {
        const int32_t next = neighbours[3 * triangles[i] + k];
        if (next < 0 || is_done[next] || photos[next] != photos[first]) continue;
        is_done[next] = true;
        triangles.push_back(static_cast<size_t>(next));
      }
    }
    charts.push_back({photos[first], std::move(triangles), {}, {}, 0});
  }
  return charts;
}

// Places of rectangles in rows, the tallest first.
class Packer {
 public:
  explicit Packer(int side) : side_(side) {}

  void Place(Chart* chart) {
    cv::Rect& place = chart->place;
    if (x_ + place.width > side_) {
      x_ = 0;
      y_ = std::exchange(row_, 0) + y_;
    }
    if (y_ + place.height > side_) {
      ++page_;
      x_ = y_ = row_ = 0;
    }
    place.x = std::exchange(x_, x_ + place.width);
    place.y = y_;
    row_ = std::max(row_, place.height);
    chart->page = page_;
  }

 private:
  const int side_;
  int x_ = 0, y_ = 0, row_ = 0;  // row: height of the row that begins at y
  size_t page_ = 0;
};

// Adds corners of triangles to a part, a vertex of the mesh once.
class CornerAdder {
 public:
  explicit CornerAdder(MeshPart* part) : part_(*part) {}

  // True if the vertex is new.
  bool Add(uint32_t vertex) {
    const auto [at, is_new] =
        indices_.emplace(vertex, static_cast<uint32_t>(part_.vertices.size()));
    if (is_new) part_.vertices.push_back(vertex);
    part_.indices.push_back(at->second);
    return is_new;
  }

 private:
  MeshPart& part_;
  std::unordered_map<uint32_t, uint32_t> indices_;  // in the part
};

class Texturer {
 public:
  Texturer(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps,
           const TexturePhotos& photos, const TextureOptions& options)
      : mesh_(mesh), maps_(maps), photos_(photos), options_(options) {}

  Result<std::vector<MeshPart>> Make() {
    const std::vector<TriangleViews> views = ViewsOf(mesh_, maps_, options_.num_threads);
    const std::vector<int32_t> neighbours = NeighboursOf(mesh_);
    const std::vector<int32_t> chosen = ChoosePhotos(views, neighbours);
    charts_ = ChartsOf(chosen, neighbours);
    gains_ = PhotoGains(mesh_, maps_, views);
    SetBoxes();
    Pack();
    if (Status status = Paint(); !status.ok()) return status;
    AddRest(chosen);
    return std::move(parts_);
  }

 private:
  Eigen::Vector2d PixelOf(uint32_t vertex, int32_t photo) const {
    const Eigen::Vector3d point = mesh_.Position(mesh_.vertices[vertex]);
    const Eigen::Vector3d in_camera = maps_[photo].map->cam_from_world.ToCamera(point);
    return photos_.cameras[photo].Pixel(in_camera.hnormalized());
  }

  void SetBoxes() {
    for (Chart& chart : charts_) {
      Eigen::AlignedBox2d box;
      for (const size_t triangle : chart.triangles) {
        for (size_t k = 0; k < 3; ++k) {
          box.extend(PixelOf(mesh_.indices[3 * triangle + k], chart.photo));
        }
      }
      const Eigen::Array2i low = (box.min().array() - kBorderPx).floor().cast<int>();
      const Eigen::Array2i high = (box.max().array() + kBorderPx).ceil().cast<int>();
      const DepthCamera& camera = photos_.cameras[chart.photo];
      chart.box = cv::Rect(cv::Point(low.x(), low.y()), cv::Point(high.x(), high.y())) &
                  cv::Rect(0, 0, camera.width, camera.height);
    }
  }

  // Texture pixels a pixel of the photos.
  double Scale() const {
    double area = 0, longest = 0;
    for (const Chart& chart : charts_) {
      area += chart.box.area();
      longest = std::max<double>({longest, 1.0 * chart.box.width, 1.0 * chart.box.height});
    }
    return std::min({1.0, std::sqrt(options_.max_pixels / area), options_.page_px / longest});
  }

  void Pack() {
    const double scale = Scale();
    const auto reduced = [&](int side) {
      return std::clamp(static_cast<int>(std::lround(scale * side)), 1, options_.page_px);
    };
    for (Chart& chart : charts_) {
      chart.place = cv::Rect(0, 0, reduced(chart.box.width), reduced(chart.box.height));
    }
    std::vector<Chart*> order;
    for (Chart& chart : charts_) order.push_back(&chart);
    std::stable_sort(order.begin(), order.end(), [](const Chart* a, const Chart* b) {
      return a->place.height > b->place.height;
    });
    Packer packer(options_.page_px);
    for (Chart* chart : order) packer.Place(chart);
    MakePages();
  }

  void MakePages() {
    std::vector<cv::Rect> extents;
    for (const Chart& chart : charts_) {
      if (chart.page >= extents.size()) extents.resize(chart.page + 1);
      extents[chart.page] |= chart.place;
    }
    for (const cv::Rect& extent : extents) {
      parts_.emplace_back().texture = cv::Mat3b(extent.height, extent.width, cv::Vec3b());
    }
    for (const Chart& chart : charts_) AddTriangles(chart, &parts_[chart.page]);
  }

  void AddTriangles(const Chart& chart, MeshPart* part) const {
    const Eigen::Array2d ratio(1.0 * chart.place.width / chart.box.width,
                               1.0 * chart.place.height / chart.box.height);
    const Eigen::Array2d page(part->texture.cols, part->texture.rows);
    CornerAdder corners(part);
    for (const size_t triangle : chart.triangles) {
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t vertex = mesh_.indices[3 * triangle + k];
        if (!corners.Add(vertex)) continue;
        const Eigen::Array2d in_box =
            PixelOf(vertex, chart.photo).array() - Eigen::Array2d(chart.box.x, chart.box.y);
        const Eigen::Array2d place =
            (Eigen::Array2d(chart.place.x, chart.place.y) + ratio * in_box) / page;
        part->places.push_back(place.matrix().cast<float>());
      }
    }
  }

  // Each photo is read once.
  Status Paint() {
    std::vector<std::vector<const Chart*>> charts_of(maps_.size());
    for (const Chart& chart : charts_) charts_of[chart.photo].push_back(&chart);
    for (size_t i = 0; i < charts_of.size(); ++i) {
      if (charts_of[i].empty()) continue;
      const Result<cv::Mat3b> photo = photos_.pixels(i);
      if (!photo.ok()) return photo.status();
      for (const Chart* chart : charts_of[i]) PaintChart(*photo, *chart);
    }
    return {};
  }

  void PaintChart(const cv::Mat3b& photo, const Chart& chart) {
    const ColourGain& gain = gains_[chart.photo];
    cv::Mat3b texture;
    cv::resize(photo(chart.box), texture, chart.place.size(), 0, 0, cv::INTER_AREA);
    cv::multiply(texture, cv::Scalar(gain[0], gain[1], gain[2]), texture);
    texture.copyTo(parts_[chart.page].texture(chart.place));
  }

  // Triangles that no photo shows.
  void AddRest(const std::vector<int32_t>& chosen) {
    MeshPart rest;
    CornerAdder corners(&rest);
    for (size_t at = 0; at < mesh_.indices.size(); ++at) {
      if (chosen[at / 3] < 0) corners.Add(mesh_.indices[at]);
    }
    if (!rest.indices.empty()) parts_.push_back(std::move(rest));
  }

  const SurfaceMesh& mesh_;
  const std::vector<ColouredMap>& maps_;
  const TexturePhotos& photos_;
  const TextureOptions& options_;
  std::vector<Chart> charts_;
  std::vector<ColourGain> gains_;
  std::vector<MeshPart> parts_;
};

}  // namespace

Result<std::vector<MeshPart>> TextureOf(const SurfaceMesh& mesh,
                                        const std::vector<ColouredMap>& maps,
                                        const TexturePhotos& photos,
                                        const TextureOptions& options) {
  if (photos.cameras.size() != maps.size()) throw std::invalid_argument("a camera for each map");
  return Texturer(mesh, maps, photos, options).Make();
}

}  // namespace skein
