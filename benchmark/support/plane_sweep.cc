#include "benchmark/support/plane_sweep.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

namespace skein {
namespace {

// Fixed: the measure of one capture compares with that of another.
constexpr int kWindowPx = 7;        // odd
constexpr double kPlaneStepPx = 1;  // between planes, in the neighbour where it is largest
constexpr int kMinPlanes = 8, kMaxPlanes = 120;
constexpr double kMinZncc = 0.6;
constexpr double kMinContrast = 1.5;  // standard deviation of the reference's window, grey levels
constexpr int kMinAgreeing = 2;       // depth maps of other photos that keep a point
constexpr double kMaxReprojectionPx = 1;
constexpr double kMaxDepthDifference = 0.01;  // part of the depth
constexpr int kStridePx = 2;

constexpr float kMiddleGrey = 128;
constexpr float kOutside = -kMiddleGrey - 1;  // what a warped photo has where it shows nothing
constexpr float kNoScore = -1;                // ZNCC's least

// OpenCV has the centre of the upper left pixel at (0, 0).
Eigen::Matrix3d OpenCvCalibration(const SweepPhoto& photo) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = k(1, 1) = photo.focal_px;
  k.topRightCorner<2, 1>() = photo.principal_point.array() - 0.5;
  return k;
}

struct RelativePose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

RelativePose OtherFromReference(const SweepPhoto& reference, const SweepPhoto& other) {
  const Eigen::Quaterniond rotation =
      other.cam_from_world.rotation * reference.cam_from_world.rotation.conjugate();
  return {rotation.toRotationMatrix(),
          other.cam_from_world.translation - rotation * reference.cam_from_world.translation};
}

// The other photo's pixel of a reference's pixel, by a plane at right angles to the view axis.
Eigen::Matrix3d HomographyOfPlane(const SweepPhoto& reference, const SweepPhoto& other,
                                  double inverse_depth) {
  const RelativePose pose = OtherFromReference(reference, other);
  Eigen::Matrix3d plane = pose.rotation;
  plane.col(2) += inverse_depth * pose.translation;
  return OpenCvCalibration(other) * plane * OpenCvCalibration(reference).inverse();
}

// Of the reference's pixel `at` over the whole search, in the other photo.
double SearchLengthPx(const SweepPhoto& reference, const SweepPhoto& other,
                      const Eigen::Vector2d& at) {
  const auto pixel = [&](double depth) -> Eigen::Vector3d {
    return HomographyOfPlane(reference, other, 1 / depth) * at.homogeneous();
  };
  const Eigen::Vector3d near = pixel(reference.near), far = pixel(reference.far);
  if (near.z() <= 0 || far.z() <= 0) return 0;
  return (near.hnormalized() - far.hnormalized()).norm();
}

int NumPlanes(const std::vector<SweepPhoto>& photos, int reference) {
  const SweepPhoto& photo = photos[reference];
  double longest = 0;
  for (const int other : photo.neighbours) {
    for (const double x : {0.25, 0.75}) {
      for (const double y : {0.25, 0.75}) {
        longest = std::max(longest, SearchLengthPx(photo, photos[other],
                                                   {x * photo.grey.cols, y * photo.grey.rows}));
      }
    }
  }
  return std::clamp(static_cast<int>(longest / kPlaneStepPx) + 2, kMinPlanes, kMaxPlanes);
}

// A photo with the means and deviations of its windows. Grey levels are taken from the middle one,
// so that sums of squares stay exact.
struct Windows {
  cv::Mat1f grey, mean, deviation;
};

Windows MakeWindows(const cv::Mat1f& photo, int window_px) {
  const cv::Size window(window_px, window_px);
  Windows windows{photo - kMiddleGrey, {}, {}};
  cv::Mat1f mean_of_squares;
  cv::boxFilter(windows.grey, windows.mean, CV_32F, window);
  cv::sqrBoxFilter(windows.grey, mean_of_squares, CV_32F, window);
  const cv::Mat1f variance = mean_of_squares - windows.mean.mul(windows.mean);
  cv::sqrt(cv::max(variance, 0.0f), windows.deviation);
  return windows;
}

// The photo as the reference sees it by the plane of `h`, from the middle grey; kOutside where it
// shows nothing. Bilinear; cv::warpPerspective rounds to a 32nd of a pixel.
void Warp(const cv::Mat1f& photo, const Eigen::Matrix3d& h, cv::Mat1f* warped) {
  const Eigen::Vector3f step = h.col(0).cast<float>();
  const float right = static_cast<float>(photo.cols - 1),
              bottom = static_cast<float>(photo.rows - 1);
  std::vector<float> u(warped->cols), v(warped->cols);
  for (int y = 0; y < warped->rows; ++y) {
    const Eigen::Vector3f row = (h.col(1) * y + h.col(2)).cast<float>();
    for (int x = 0; x < warped->cols; ++x) {
      const float w = row.z() + static_cast<float>(x) * step.z();
      const float inverse = w > 0 ? 1 / w : -1;  // behind the camera: outside
      u[x] = (row.x() + static_cast<float>(x) * step.x()) * inverse;
      v[x] = w > 0 ? (row.y() + static_cast<float>(x) * step.y()) * inverse : -1;
    }
    float* out = (*warped)[y];
    for (int x = 0; x < warped->cols; ++x) {
      if (!(u[x] >= 0 && v[x] >= 0 && u[x] < right && v[x] < bottom)) {
        out[x] = kOutside;
        continue;
      }
      const int left = static_cast<int>(u[x]), top = static_cast<int>(v[x]);
      const float a = u[x] - static_cast<float>(left), b = v[x] - static_cast<float>(top);
      const float *upper = photo[top] + left, *lower = photo[top + 1] + left;
      const float above = upper[0] + a * (upper[1] - upper[0]);
      const float below = lower[0] + a * (lower[1] - lower[0]);
      out[x] = above + b * (below - above) - kMiddleGrey;
    }
  }
}

// Sums over windows, row by row: those of the columns are kept.
class WindowSums {
 public:
  WindowSums(const cv::Mat1f& reference, const cv::Mat1f& other, int window_px)
      : reference_(reference), other_(other), window_px_(window_px) {
    for (auto* sums : {&sum_, &squares_, &products_}) sums->assign(other.cols, 0.0f);
    for (auto* sums : {&in_row_, &squares_in_row_, &products_in_row_}) {
      sums->assign(other.cols, 0.0f);
    }
    for (int y = 0; y < window_px; ++y) AddRow(y, 1);
  }

  // To the windows whose upper row is `y`, one below the last ones.
  void MoveDown(int y) {
    AddRow(y + window_px_ - 1, 1);
    AddRow(y - 1, -1);
  }

  // Of the windows whose left column is the index.
  void SumRow() {
    SumAlong(sum_, &in_row_);
    SumAlong(squares_, &squares_in_row_);
    SumAlong(products_, &products_in_row_);
  }
  const float* Sum() const { return in_row_.data(); }
  const float* Squares() const { return squares_in_row_.data(); }
  const float* Products() const { return products_in_row_.data(); }

 private:
  void AddRow(int y, float sign) {
    const float *a = reference_[y], *b = other_[y];
    float *sum = sum_.data(), *squares = squares_.data(), *products = products_.data();
    const int cols = other_.cols;
    for (int x = 0; x < cols; ++x) {
      const float signed_b = sign * b[x];
      sum[x] += signed_b;
      squares[x] += signed_b * b[x];
      products[x] += signed_b * a[x];
    }
  }

  void SumAlong(const std::vector<float>& columns, std::vector<float>* sums) const {
    const int count = other_.cols - window_px_ + 1;
    float* out = sums->data();
    for (int x = 0; x < count; ++x) out[x] = columns[x];
    for (int k = 1; k < window_px_; ++k) {
      const float* in = columns.data() + k;
      for (int x = 0; x < count; ++x) out[x] += in[x];
    }
  }

  const cv::Mat1f &reference_, &other_;
  const int window_px_;
  std::vector<float> sum_, squares_, products_;  // of columns
  std::vector<float> in_row_, squares_in_row_, products_in_row_;
};

// ZNCC of each window; kNoScore where the other photo shows nothing, and along the edges.
void Correlate(const Windows& reference, const cv::Mat1f& other, int window_px, cv::Mat1f* score) {
  score->setTo(kNoScore);
  if (other.rows < window_px || other.cols < window_px) return;
  const int radius = window_px / 2;
  const float share = 1 / static_cast<float>(window_px * window_px);
  WindowSums sums(reference.grey, other, window_px);
  for (int top = 0; top + window_px <= other.rows; ++top) {
    if (top > 0) sums.MoveDown(top);
    sums.SumRow();
    const int y = top + radius;
    const float *seen = other[y] + radius, *mean = reference.mean[y] + radius,
                *deviation = reference.deviation[y] + radius;
    float* out = (*score)[y] + radius;
    const float *sum = sums.Sum(), *squares = sums.Squares(), *products = sums.Products();
    const int num_windows = other.cols - window_px + 1;
    for (int left = 0; left < num_windows; ++left) {
      const float other_mean = share * sum[left];
      const float variance = std::max(share * squares[left] - other_mean * other_mean, 1e-3f);
      const float covariance = share * products[left] - mean[left] * other_mean;
      const float zncc = covariance / (std::sqrt(variance) * std::max(deviation[left], 0.03f));
      out[left] = seen[left] <= kOutside ? kNoScore : zncc;
    }
  }
}

// Mean over the better half of the neighbours.
cv::Mat1f ScorePlane(const std::vector<SweepPhoto>& photos, int reference, const Windows& windows,
                     double inverse_depth) {
  const SweepPhoto& photo = photos[reference];
  std::vector<cv::Mat1f> best((photo.neighbours.size() + 1) / 2);  // descending at each pixel
  for (cv::Mat1f& b : best) b = cv::Mat1f(photo.grey.size(), kNoScore);
  cv::Mat1f warped(photo.grey.size()), score(photo.grey.size());
  for (const int other : photo.neighbours) {
    Warp(photos[other].grey, HomographyOfPlane(photo, photos[other], inverse_depth), &warped);
    Correlate(windows, warped, kWindowPx, &score);
    for (cv::Mat1f& b : best) {
      const cv::Mat1f higher = cv::max(b, score);
      score = cv::min(b, score);
      b = higher;
    }
  }
  cv::Mat1f sum = best[0];
  for (size_t i = 1; i < best.size(); ++i) sum += best[i];
  return sum / static_cast<double>(best.size());
}

// The best plane of each pixel, and the scores beside it.
class Winners {
 public:
  explicit Winners(const cv::Size& size)
      : plane_(size, -1),
        score_(size, kNoScore),
        before_(size, kNoScore),
        after_(size, kNoScore),
        last_(size, kNoScore) {}

  void Add(int plane, const cv::Mat1f& score) {
    for (int y = 0; y < score.rows; ++y) {
      for (int x = 0; x < score.cols; ++x) {
        const float s = score(y, x);
        if (s > score_(y, x)) {
          score_(y, x) = s;
          plane_(y, x) = plane;
          before_(y, x) = last_(y, x);
          after_(y, x) = kNoScore;
        } else if (plane_(y, x) == plane - 1) {
          after_(y, x) = s;
        }
      }
    }
    last_ = score;
  }

  float Score(int x, int y) const { return score_(y, x); }
  // With the top of the parabola through three scores. Nothing at an end of the search: the true
  // depth may lie beyond.
  std::optional<double> Plane(int x, int y) const {
    const double low = before_(y, x), top = score_(y, x), high = after_(y, x);
    if (plane_(y, x) < 0 || low <= kNoScore || high <= kNoScore) return std::nullopt;
    const double curvature = low - 2 * top + high;
    const double shift = curvature < -1e-9 ? (low - high) / (2 * curvature) : 0;
    return plane_(y, x) + std::clamp(shift, -0.5, 0.5);
  }

 private:
  cv::Mat1i plane_;
  cv::Mat1f score_, before_, after_, last_;
};

Eigen::Vector3d WorldPoint(const SweepPhoto& photo, const Eigen::Vector2d& pixel, double depth) {
  const Eigen::Vector2d uv = (pixel - photo.principal_point) / photo.focal_px;
  const Eigen::Vector3d in_camera = depth * uv.homogeneous();
  return photo.cam_from_world.rotation.conjugate() * (in_camera - photo.cam_from_world.translation);
}

Eigen::Vector2d PixelOf(const SweepPhoto& photo, const Eigen::Vector3d& in_camera) {
  return photo.focal_px * in_camera.hnormalized() + photo.principal_point;
}

bool Agrees(const SweepPhoto& reference, const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
            const SweepPhoto& other, const cv::Mat1f& depths) {
  if (depths.empty()) return false;
  const Eigen::Vector3d in_other = other.cam_from_world.Apply(point);
  if (in_other.z() <= 0) return false;
  const Eigen::Vector2d there = PixelOf(other, in_other);
  const int x = static_cast<int>(std::floor(there.x())),
            y = static_cast<int>(std::floor(there.y()));
  if (x < 0 || y < 0 || x >= depths.cols || y >= depths.rows) return false;
  const double depth = depths(y, x);
  if (std::abs(depth - in_other.z()) > kMaxDepthDifference * in_other.z()) return false;
  const Eigen::Vector3d back = reference.cam_from_world.Apply(WorldPoint(other, there, depth));
  return back.z() > 0 && (PixelOf(reference, back) - pixel).norm() <= kMaxReprojectionPx;
}

}  // namespace

cv::Mat1f SweepDepth(const std::vector<SweepPhoto>& photos, int reference) {
  const SweepPhoto& photo = photos[reference];
  cv::Mat1f depths(photo.grey.size(), 0.0f);
  if (photo.neighbours.empty()) return depths;
  if (!(photo.near > 0 && photo.near < photo.far)) {
    throw std::invalid_argument("plane sweep: give depths 0 < near < far");
  }
  const Windows windows = MakeWindows(photo.grey, kWindowPx);
  const int num_planes = NumPlanes(photos, reference);
  const double step = (1 / photo.near - 1 / photo.far) / (num_planes - 1);
  const auto inverse_depth = [&](double plane) { return 1 / photo.far + plane * step; };
  Winners winners(photo.grey.size());
  for (int i = 0; i < num_planes; ++i) {
    winners.Add(i, ScorePlane(photos, reference, windows, inverse_depth(i)));
  }
  for (int y = 0; y < depths.rows; ++y) {
    for (int x = 0; x < depths.cols; ++x) {
      if (winners.Score(x, y) < kMinZncc) continue;
      if (windows.deviation(y, x) < kMinContrast) continue;
      const std::optional<double> plane = winners.Plane(x, y);
      if (plane) depths(y, x) = static_cast<float>(1 / inverse_depth(*plane));
    }
  }
  return depths;
}

std::vector<Eigen::Vector3d> ConsistentPoints(const std::vector<SweepPhoto>& photos,
                                              const std::vector<cv::Mat1f>& depths, int reference,
                                              const std::vector<int>& others) {
  std::vector<Eigen::Vector3d> points;
  const SweepPhoto& photo = photos[reference];
  const cv::Mat1f& of_reference = depths[reference];
  for (int y = 0; y < of_reference.rows; y += kStridePx) {
    for (int x = 0; x < of_reference.cols; x += kStridePx) {
      if (of_reference(y, x) <= 0) continue;
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const Eigen::Vector3d point = WorldPoint(photo, pixel, of_reference(y, x));
      const auto agreeing = std::count_if(others.begin(), others.end(), [&](int other) {
        return Agrees(photo, pixel, point, photos[other], depths[other]);
      });
      if (agreeing >= kMinAgreeing) points.push_back(point);
    }
  }
  return points;
}

}  // namespace skein
