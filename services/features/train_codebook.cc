#include "features/train_codebook.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>

#include "core/local_descriptor.h"
#include "features/vlad.h"

namespace skein {
namespace {

using Matrix = Codebook::Matrix;

constexpr int kNumIterations = 25;
constexpr int kNumAttempts = 8;              // of k-means
constexpr size_t kMaxDescriptors = 300'000;  // drawn at random when there are more

void Check(const TrainingOptions& options, size_t num_descriptors) {
  if (options.local_dim > kDescriptorDim || options.cell_dim > options.local_dim ||
      options.cell_dim < 1 || options.num_cells < 1) {
    throw std::invalid_argument("codebook dimensions must be 128 >= local >= cell >= 1");
  }
  if (num_descriptors < 10 * static_cast<size_t>(options.num_cells)) {
    throw std::invalid_argument("too few descriptors to train " +
                                std::to_string(options.num_cells) + " cells");
  }
}

size_t CountDescriptors(const std::vector<LocalFeatures>& photos) {
  size_t count = 0;
  for (const auto& photo : photos) count += photo.descriptors.rows();
  return count;
}

// At most `count` descriptors of all photos, in random order.
std::vector<uint8_t> Sample(const std::vector<LocalFeatures>& photos, size_t count,
                            std::mt19937_64* random) {
  std::vector<const uint8_t*> rows;
  for (const auto& photo : photos) {
    for (size_t i = 0; i < photo.descriptors.rows(); ++i) rows.push_back(photo.descriptors.row(i));
  }
  std::shuffle(rows.begin(), rows.end(), *random);
  rows.resize(std::min(rows.size(), count));
  std::vector<uint8_t> sample;
  sample.reserve(rows.size() * kDescriptorDim);
  for (const uint8_t* row : rows) sample.insert(sample.end(), row, row + kDescriptorDim);
  return sample;
}

// The `count` principal axes of the rows' second moments, strongest first, one a row.
Matrix PrincipalAxes(const Matrix& rows, int count) {
  const Eigen::MatrixXd moments =
      (rows.transpose() * rows).cast<double>() / std::max<Eigen::Index>(1, rows.rows());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(moments);
  return solver.eigenvectors().rightCols(count).rowwise().reverse().transpose().cast<float>();
}

void LearnProjection(const std::vector<uint8_t>& descriptors, int local_dim, Codebook* codebook) {
  codebook->mean = Eigen::VectorXf::Zero(kDescriptorDim);
  codebook->projection = Matrix::Identity(kDescriptorDim, kDescriptorDim);
  Matrix centred =
      ProjectDescriptors(*codebook, descriptors.data(), descriptors.size() / kDescriptorDim);
  codebook->mean = centred.cast<double>().colwise().mean().transpose().cast<float>();
  centred.rowwise() -= codebook->mean.transpose();
  codebook->projection = PrincipalAxes(centred, local_dim);
}

// k-means++, the attempt with the least sum of squared distances.
Matrix LearnCentres(const Matrix& points, const TrainingOptions& options) {
  const cv::Mat rows(static_cast<int>(points.rows()), static_cast<int>(points.cols()), CV_32F,
                     const_cast<float*>(points.data()));
  cv::Mat cells, centres;
  cv::setRNGSeed(static_cast<int>(options.seed));
  cv::kmeans(rows, options.num_cells, cells, {cv::TermCriteria::COUNT, kNumIterations, 0},
             kNumAttempts, cv::KMEANS_PP_CENTERS, centres);
  return Eigen::Map<const Matrix>(centres.ptr<float>(), centres.rows, centres.cols);
}

Matrix UnitResidualsOf(int cell, const Matrix& points, const std::vector<int>& cells,
                       const Matrix& centres) {
  Matrix residuals(std::count(cells.begin(), cells.end(), cell), points.cols());
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (cells[i] == cell) residuals.row(next++) = (points.row(i) - centres.row(cell)).normalized();
  }
  return residuals;
}

void LearnCellAxes(const Matrix& points, int cell_dim, Codebook* codebook) {
  const std::vector<int> cells = NearestCentres(points, codebook->centres);
  codebook->cell_axes.resize(codebook->num_cells() * cell_dim, points.cols());
  for (int k = 0; k < codebook->num_cells(); ++k) {
    codebook->cell_axes.middleRows(k * cell_dim, cell_dim) =
        PrincipalAxes(UnitResidualsOf(k, points, cells, codebook->centres), cell_dim);
  }
}

void LearnPhotoMean(const std::vector<LocalFeatures>& photos, Codebook* codebook) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(codebook->cell_axes.rows());
  for (const auto& photo : photos) sum += AggregateVlad(*codebook, photo).cast<double>();
  codebook->photo_mean = (sum / static_cast<double>(photos.size())).cast<float>();
}

cv::Mat RandomView(cv::Size size, cv::RNG* random) {
  const double angle_deg = random->uniform(-25.0, 25.0);
  const double scale = random->uniform(0.5, 1.0);
  const cv::Point2f centre(size.width / 2.f, size.height / 2.f);
  const cv::Mat similarity = cv::getRotationMatrix2D(centre, angle_deg, scale);
  cv::Mat view = cv::Mat::eye(3, 3, CV_64F);
  similarity.copyTo(view.rowRange(0, 2));
  view.at<double>(2, 0) = random->uniform(-0.2, 0.2) / size.width;
  view.at<double>(2, 1) = random->uniform(-0.2, 0.2) / size.height;
  return view;
}

}  // namespace

Codebook TrainCodebook(const std::vector<LocalFeatures>& photos, const std::string& id,
                       const TrainingOptions& options) {
  Check(options, CountDescriptors(photos));
  std::mt19937_64 random(options.seed);
  const std::vector<uint8_t> sample = Sample(photos, kMaxDescriptors, &random);
  Codebook codebook;
  codebook.id = id;
  LearnProjection(sample, options.local_dim, &codebook);
  const Matrix points = ProjectDescriptors(codebook, sample.data(), sample.size() / kDescriptorDim);
  codebook.centres = LearnCentres(points, options);
  LearnCellAxes(points, options.cell_dim, &codebook);
  LearnPhotoMean(photos, &codebook);
  return codebook;
}

cv::Mat AugmentPhoto(const cv::Mat& photo, uint64_t seed) {
  cv::RNG random(seed + 1);
  cv::Mat view;
  cv::warpPerspective(photo, view, RandomView(photo.size(), &random), photo.size(), cv::INTER_AREA,
                      cv::BORDER_REFLECT);
  view.convertTo(view, CV_8UC3, random.uniform(0.7, 1.3), random.uniform(-25.0, 25.0));
  const double blur_px = random.uniform(0.0, 1.2);
  if (blur_px > 0.3) cv::GaussianBlur(view, view, {}, blur_px);
  cv::Mat noise(view.size(), CV_16SC3);
  random.fill(noise, cv::RNG::NORMAL, 0, random.uniform(0.0, 6.0));
  cv::add(view, noise, view, cv::noArray(), CV_8UC3);
  return view;
}

}  // namespace skein
