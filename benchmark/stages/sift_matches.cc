// Skein's SIFT beside OpenCV's, by use: how many matches of photos with known poses are within 1
// and 4 px of their epipolar lines, and what the features cost.
//
//   sift_matches --images FOLDER --model COLMAP_MODEL [options]
//
// COLMAP_MODEL: poses and cameras, true ones or those of a finished session (points3D may be
// empty). Photos are paired with the next ones by name.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "codecs/image_decoding.h"
#include "core/clock.h"
#include "core/file.h"
#include "features/sift.h"
#include "matching/kernel.h"
#include "sfm/model_files.h"

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string images, model, only;
  int photos = 12, neighbours = 3, repetitions = 3, max_features = 8192;
};

struct Method {
  std::string name;
  std::unique_ptr<skein::SiftExtractor> extractor;
  std::vector<skein::LocalFeatures> features;
  std::vector<double> cpu_s;
};

struct Photo {
  const skein::Image* image;
  const skein::Camera* camera;
  std::string path;
};

fs::path FindPhoto(const fs::path& folder, const std::string& name) {
  for (const fs::path& path : {folder / name, folder / fs::path(name).filename()}) {
    if (fs::exists(path)) return path;
  }
  return {};
}

// Some in a row, so that neighbours overlap, from all over the set.
std::vector<Photo> PhotosOf(const skein::Reconstruction& model, const Arguments& arguments) {
  std::map<std::string, Photo> all;
  for (const auto& [id, image] : model.Images()) {
    const fs::path path = FindPhoto(arguments.images, image.Name());
    if (!path.empty()) all[image.Name()] = {&image, &model.Camera(image.CameraId()), path};
  }
  std::vector<Photo> photos;
  for (const auto& [name, photo] : all) photos.push_back(photo);
  const size_t count = std::min(photos.size(), static_cast<size_t>(arguments.photos));
  const size_t run = static_cast<size_t>(arguments.neighbours) + 1;
  const size_t runs = std::max<size_t>(1, count / run);
  std::vector<Photo> some;
  for (size_t r = 0; r < runs; ++r) {
    for (size_t i = 0; i < run; ++i) {
      const size_t at = r * photos.size() / runs + i;
      if (some.size() < count && at < photos.size()) some.push_back(photos[at]);
    }
  }
  return some;
}

Eigen::Matrix3d Essential(const skein::Image& a, const skein::Image& b) {
  const Eigen::Matrix3d rotation = b.RotationMatrix() * a.RotationMatrix().transpose();
  const Eigen::Vector3d t = b.Tvec() - rotation * a.Tvec();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross * rotation;
}

Eigen::Vector3d Ray(const Photo& photo, const skein::Keypoint& k) {
  return photo.camera->ImageToWorld(Eigen::Vector2d(k.x, k.y)).homogeneous();
}

// Sampson distance, pixels of the first photo.
double Distance(const Eigen::Matrix3d& E, const Photo& photo, const Eigen::Vector3d& a,
                const Eigen::Vector3d& b) {
  const Eigen::Vector3d line = E * a, back = E.transpose() * b;
  const double norm = std::sqrt(line.head<2>().squaredNorm() + back.head<2>().squaredNorm());
  return std::abs(b.dot(line)) / norm * photo.camera->MeanFocalLength();
}

std::vector<double> Distances(const Photo& a, const Photo& b, const skein::LocalFeatures& fa,
                              const skein::LocalFeatures& fb) {
  static skein::DescriptorMatcher matcher{skein::MatchOptions()};
  const Eigen::Matrix3d E = Essential(*a.image, *b.image);
  std::vector<double> distances;
  const auto first = skein::CompactDescriptors(fa.descriptors.data);
  const auto second = skein::CompactDescriptors(fb.descriptors.data);
  for (const auto& m : matcher.Match({first.data(), static_cast<int>(fa.keypoints.size())},
                                     {second.data(), static_cast<int>(fb.keypoints.size())})) {
    distances.push_back(
        Distance(E, a, Ray(a, fa.keypoints[m.first]), Ray(b, fb.keypoints[m.second])));
  }
  return distances;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void Describe(const Photo& photo, int repetitions, std::vector<Method>* methods) {
  const auto bytes = skein::ReadFile(photo.path);
  if (!bytes) throw std::runtime_error(bytes.error());
  const auto image = skein::DecodePhoto(*bytes);
  if (!image) throw std::runtime_error(photo.path + ": " + image.error());
  for (Method& method : *methods) method.cpu_s.push_back(1e9);
  for (int i = 0; i < repetitions; ++i) {
    for (Method& method : *methods) {
      const double start_s = skein::ThreadCpuS();
      auto features = method.extractor->Extract(*image);
      method.cpu_s.back() = std::min(method.cpu_s.back(), skein::ThreadCpuS() - start_s);
      if (i == 0) method.features.push_back(std::move(features));
    }
  }
}

void Print(const Method& method, const std::vector<Photo>& photos, int neighbours) {
  std::vector<double> distances;
  size_t pairs = 0, keypoints = 0;
  for (const auto& features : method.features) keypoints += features.keypoints.size();
  for (size_t i = 0; i < photos.size(); ++i) {
    for (size_t j = i + 1; j < photos.size() && j <= i + neighbours; ++j) {
      const auto some = Distances(photos[i], photos[j], method.features[i], method.features[j]);
      distances.insert(distances.end(), some.begin(), some.end());
      ++pairs;
    }
  }
  const auto below = [&](double px) {
    return std::count_if(distances.begin(), distances.end(), [&](double d) { return d < px; });
  };
  std::vector<double> near;
  for (const double d : distances) {
    if (d < 4) near.push_back(d);
  }
  std::printf("| %s | %zu | %zu | %zu | %zu | %ld | %ld | %.3f | %.3f |\n", method.name.c_str(),
              photos.size(), keypoints / photos.size(), pairs, distances.size(), below(4), below(1),
              Quantile(near, 0.5), Quantile(method.cpu_s, 0.5));
}

std::vector<Method> MethodsOf(const Arguments& arguments) {
  const auto is_wanted = [&](const std::string& name) {
    return arguments.only.empty() || arguments.only == name;
  };
  std::vector<Method> methods;
  skein::SiftOptions options;
  options.max_features = arguments.max_features;
  options.method = "opencv";
  if (is_wanted("opencv")) {
    methods.push_back({"OpenCV", std::make_unique<skein::SiftExtractor>(options), {}, {}});
  }
  options.method = "skein";
  for (const auto version : skein::kInstructionSets) {
    const std::string name = skein::InstructionSetName(version);
    if (!skein::IsInstructionSetSupported(version) || !is_wanted(name)) continue;
    options.kernel = version;
    methods.push_back({"Skein, " + name, std::make_unique<skein::SiftExtractor>(options), {}, {}});
  }
  return methods;
}

int Main(int argc, char** argv) {
  CLI::App app("Skein's SIFT beside OpenCV's, by use.");
  Arguments arguments;
  app.add_option("--images", arguments.images, "Folder of the photos")->required();
  app.add_option("--model", arguments.model, "COLMAP model: poses and cameras")->required();
  app.add_option("--photos", arguments.photos, "Most photos");
  app.add_option("--neighbours", arguments.neighbours, "Photos each is matched with");
  app.add_option("--repetitions", arguments.repetitions, "The least CPU time of these counts");
  app.add_option("--max-features", arguments.max_features, "Most keypoints a photo");
  app.add_option("--only", arguments.only, "opencv, portable, avx2 or avx512 alone");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  const skein::Result<skein::Reconstruction> read = skein::ReadModelFiles(arguments.model);
  if (!read) throw std::runtime_error(read.error());
  const skein::Reconstruction& model = *read;
  const auto photos = PhotosOf(model, arguments);
  if (photos.empty()) throw std::runtime_error("no photo of the model in " + arguments.images);

  std::vector<Method> methods = MethodsOf(arguments);
  for (const Photo& photo : photos) Describe(photo, arguments.repetitions, &methods);
  std::printf("commit %s, %s\n", SKEIN_COMMIT, arguments.images.c_str());
  std::printf(
      "| features | photos | keypoints | pairs | matches | within 4 px | within 1 px | "
      "median, px | CPU s a photo |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const Method& method : methods) Print(method, photos, arguments.neighbours);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sift_matches: %s\n", error.what());
    return 1;
  }
}
