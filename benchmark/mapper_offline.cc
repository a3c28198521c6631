// mapper_offline: feeds a COLMAP database photo by photo to the mapper, without services, and
// tells what came of it. For measuring the mapper against `colmap mapper` on the same matches.

#include <sqlite3.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <thread>
#include <tuple>

#include "base/database.h"
#include "base/similarity_transform.h"
#include "mapping/experiments/tree_window.h"
#include "mapping/submap.h"
#include "merger/seed_policy.h"

namespace skein {
namespace {

struct Arguments {
  std::string database, order = "name", ground_truth, reference, output;
  std::string camera_model = "SIMPLE_RADIAL";
  LocalBaOptions local_ba;
  std::string output_before, photo_table;
  size_t max_pairs = 30;
  bool global_ba = true;
  double focal_factor = 1.0;
  int threads = 1;
  int max_photos = 0;
  bool background = false;
  bool verbose = false;
};

double CpuSeconds() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_utime.tv_sec + usage.ru_utime.tv_usec * 1e-6 + usage.ru_stime.tv_sec +
         usage.ru_stime.tv_usec * 1e-6;
}

std::vector<colmap::Image> OrderedImages(const colmap::Database& database,
                                         const Arguments& arguments) {
  std::vector<colmap::Image> images = database.ReadAllImages();
  std::sort(images.begin(), images.end(),
            [](const auto& a, const auto& b) { return a.Name() < b.Name(); });
  if (arguments.order == "id") {
    std::sort(images.begin(), images.end(),
              [](const auto& a, const auto& b) { return a.ImageId() < b.ImageId(); });
  }
  if (arguments.order.rfind("shuffle:", 0) == 0) {
    std::mt19937 random(std::stoi(arguments.order.substr(8)));
    std::shuffle(images.begin(), images.end(), random);
  }
  if (arguments.max_photos > 0 && arguments.max_photos < static_cast<int>(images.size())) {
    images.resize(arguments.max_photos);
  }
  return images;
}

PhotoInput ReadPhoto(const colmap::Database& database, const colmap::Image& image,
                     const Arguments& arguments) {
  const colmap::Camera camera = database.ReadCamera(image.CameraId());
  PhotoInput photo;
  photo.image_id = image.ImageId();
  photo.camera_id = image.CameraId();
  photo.name = image.Name();
  photo.width_px = static_cast<int>(camera.Width());
  photo.height_px = static_cast<int>(camera.Height());
  photo.focal_px = camera.MeanFocalLength() * arguments.focal_factor;
  photo.focal_from_exif = camera.HasPriorFocalLength();
  for (const colmap::FeatureKeypoint& k : database.ReadKeypoints(image.ImageId())) {
    photo.keypoints.push_back({k.x, k.y, k.ComputeScale(), k.ComputeOrientation(), 0, 0, 0});
  }
  return photo;
}

// Verified pairs with the photos that came before, most inliers first.
TwoViewPairs ReadPairs(const colmap::Database& database, ImageId id,
                       const std::vector<ImageId>& before, size_t max_pairs) {
  TwoViewPairs pairs;
  for (const ImageId other : before) {
    if (!database.ExistsInlierMatches(id, other)) continue;
    const colmap::TwoViewGeometry geometry = database.ReadTwoViewGeometry(id, other);
    if (geometry.inlier_matches.size() < 15) continue;
    TwoViewPair pair;
    pair.other_id = other;
    for (const auto& match : geometry.inlier_matches) {
      pair.inliers.emplace_back(match.point2D_idx1, match.point2D_idx2);
    }
    pairs.push_back(pair);
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) {
    return a.inliers.size() > b.inliers.size();
  });
  if (max_pairs > 0 && pairs.size() > max_pairs) pairs.resize(max_pairs);
  return pairs;
}

using DistancesOfPhoto = std::vector<std::pair<uint32_t, double>>;

// Distances of global descriptors, of each photo to its candidates; empty when the database is
// COLMAP's own (those that `skein export` writes have them).
std::map<ImageId, DistancesOfPhoto> ReadCandidates(const std::string& file) {
  std::map<ImageId, DistancesOfPhoto> candidates;
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open_v2(file.c_str(), &raw, SQLITE_OPEN_READONLY, nullptr);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> database(raw, sqlite3_close);
  if (opened != SQLITE_OK) throw std::runtime_error("cannot open " + file);
  const auto add = [](void* to, int, char** row, char**) {
    auto& all = *static_cast<std::map<ImageId, DistancesOfPhoto>*>(to);
    all[std::stoul(row[0])].emplace_back(std::stoul(row[1]), std::stod(row[2]));
    return 0;
  };
  sqlite3_exec(raw, "SELECT image_id, other_id, distance FROM skein_candidates", add, &candidates,
               nullptr);
  return candidates;
}

// Stands for the distance of global descriptors where the database does not have them.
DistancesOfPhoto DistancesFromInliers(const TwoViewPairs& pairs) {
  DistancesOfPhoto distances;
  for (const TwoViewPair& pair : pairs) {
    const double similarity = std::min(1.0, static_cast<double>(pair.inliers.size()) / 1000.0);
    distances.emplace_back(pair.other_id, 2.0 * std::sqrt(1.0 - similarity));
  }
  return distances;
}

std::map<std::string, Eigen::Vector3d> ReadGroundTruth(const std::string& folder) {
  std::map<std::string, Eigen::Vector3d> centers;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    std::vector<double> values{std::istream_iterator<double>(file), {}};
    if (values.size() < 24) continue;
    centers[entry.path().stem().string()] = {values[21], values[22], values[23]};
  }
  return centers;
}

// Centres from a text model's images.txt.
std::map<std::string, Eigen::Vector3d> ReadReference(const std::string& folder) {
  std::map<std::string, Eigen::Vector3d> centers;
  std::ifstream file(folder + "/images.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    int id = 0, camera = 0;
    Eigen::Vector4d qvec;
    Eigen::Vector3d tvec;
    std::string name;
    fields >> id >> qvec[0] >> qvec[1] >> qvec[2] >> qvec[3] >> tvec[0] >> tvec[1] >> tvec[2] >>
        camera >> name;
    colmap::Image image;
    image.SetQvec(qvec);
    image.SetTvec(tvec);
    if (fields) centers[name] = image.ProjectionCenter();
    std::getline(file, line);
  }
  return centers;
}

// RMSE of positions after a similarity, in percent of the diagonal of the truth's bounding box.
double PositionRmsePercent(const colmap::Reconstruction& reconstruction,
                           const std::map<std::string, Eigen::Vector3d>& truth) {
  std::vector<Eigen::Vector3d> from, to;
  for (const ImageId id : reconstruction.RegImageIds()) {
    const auto it = truth.find(reconstruction.Image(id).Name());
    if (it == truth.end()) continue;
    from.push_back(reconstruction.Image(id).ProjectionCenter());
    to.push_back(it->second);
  }
  colmap::SimilarityTransform3 transform;
  if (from.size() < 3 || !transform.Estimate<true>(from, to)) return NAN;
  double sum = 0;
  Eigen::Vector3d low = to[0], high = to[0];
  for (size_t i = 0; i < from.size(); ++i) {
    transform.TransformPoint(&from[i]);
    sum += (from[i] - to[i]).squaredNorm();
    low = low.cwiseMin(to[i]);
    high = high.cwiseMax(to[i]);
  }
  return 100.0 * std::sqrt(sum / from.size()) / (high - low).norm();
}

class Run {
 public:
  explicit Run(const Arguments& arguments) : arguments_(arguments), submap_(Options(arguments)) {
    if (!arguments.ground_truth.empty()) truth_ = ReadGroundTruth(arguments.ground_truth);
    if (!arguments.reference.empty()) truth_ = ReadReference(arguments.reference);
    if (!arguments.photo_table.empty()) {
      photo_table_.open(arguments.photo_table);
      photo_table_ << "photo,image_id,map_images,ba_images,ba_s,ba_cpu_s,error_px,total_s\n";
    }
  }

  int Execute() {
    const colmap::Database database(arguments_.database);
    const std::vector<colmap::Image> images = OrderedImages(database, arguments_);
    candidates_ = ReadCandidates(arguments_.database);
    double mapper_s = 0;
    for (const colmap::Image& image : images) {
      const PhotoInput photo = ReadPhoto(database, image, arguments_);
      const TwoViewPairs pairs =
          ReadPairs(database, image.ImageId(), before_, arguments_.max_pairs);
      before_.push_back(image.ImageId());
      const double start = CpuSeconds();
      Feed(photo, pairs);
      mapper_s += CpuSeconds() - start;
    }
    Print("before finish", images.size(), mapper_s);
    if (!arguments_.output_before.empty()) Write(arguments_.output_before);
    double start = CpuSeconds();
    while (arguments_.background && submap_.Maintain(true, Sink())) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (arguments_.background) Print("at rest", images.size(), CpuSeconds() - start);
    start = CpuSeconds();
    submap_.Finish(Sink());
    Print("after finish", images.size(), CpuSeconds() - start);
    if (!arguments_.output.empty()) Write(arguments_.output);
    return 0;
  }

 private:
  static SubmapOptions Options(const Arguments& arguments) {
    SubmapOptions options;
    options.camera_model = arguments.camera_model;
    options.make_local = MakerOf(arguments.local_ba);
    if (!arguments.global_ba) options.global_growth = std::numeric_limits<double>::infinity();
    options.num_threads = arguments.threads;
    options.background = arguments.background;
    return options;
  }

  void Feed(const PhotoInput& photo, const TwoViewPairs& pairs) {
    for (const Status& status :
         {submap_.AddPhoto(photo), submap_.AddPairs(photo.image_id, pairs)}) {
      if (!status.ok()) throw std::runtime_error(photo.name + ": " + status.error());
    }
    const auto candidates = candidates_.find(photo.image_id);
    submap_.AddSimilar(photo.image_id, candidates == candidates_.end() ? DistancesFromInliers(pairs)
                                                                       : candidates->second);
    if (submap_.map().reconstruction().NumRegImages() == 0) {
      TryToStart(static_cast<ImageId>(photo.image_id));
      return;
    }
    submap_.Enqueue(photo.image_id);
    while (submap_.Step(Sink())) continue;
  }

  // The photos that verified pairs connect with this one, itself included.
  std::set<ImageId> Component(ImageId id) const {
    std::set<ImageId> component = {id};
    std::vector<ImageId> open = {id};
    while (!open.empty()) {
      const ImageId next = open.back();
      open.pop_back();
      for (const auto& [other, inliers] : submap_.map().Neighbours(next)) {
        if (submap_.map().HasPhoto(other) && component.insert(other).second) open.push_back(other);
      }
    }
    return component;
  }

  // The angle asked for is relaxed with the number of photos that wait together, as the merger
  // does: many that are not connected are no reason to start from a bad pair.
  void TryToStart(ImageId image_id) {
    const SeedOptions options;
    const std::set<ImageId> component = Component(image_id);
    const auto pairs = PairsOf(component);
    for (size_t step = 0; step < options.min_tri_angle_steps_deg.size(); ++step) {
      if (step > 0 && static_cast<int>(component.size()) < options.relax_orphans[step - 1]) return;
      for (const auto& [id, other] : pairs) {
        if (TryPair(options.min_tri_angle_steps_deg[step], id, other)) return;
      }
    }
  }

  // Most inliers first.
  std::vector<std::pair<ImageId, ImageId>> PairsOf(const std::set<ImageId>& component) const {
    std::vector<std::tuple<int, ImageId, ImageId>> ranked;
    for (const ImageId id : component) {
      for (const auto& [other, inliers] : submap_.map().Neighbours(id)) {
        if (other < id && component.count(other) > 0) ranked.emplace_back(-inliers, other, id);
      }
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::pair<ImageId, ImageId>> pairs;
    for (const auto& [inliers, id, other] : ranked) pairs.emplace_back(id, other);
    return pairs;
  }

  bool TryPair(double min_angle_deg, ImageId id, ImageId other) {
    const auto known = angle_deg_.find({id, other});
    if (known != angle_deg_.end() && known->second < min_angle_deg) return false;
    InitialPairOptions options;
    options.min_triangulation_angle_deg = min_angle_deg;
    const InitialPairResult result = submap_.Start(options, id, other, Sink());
    const bool too_small = result.forward_motion <= options.max_forward_motion &&
                           result.triangulation_angle_deg < min_angle_deg;
    angle_deg_[{id, other}] = too_small ? result.triangulation_angle_deg : 0;
    if (arguments_.verbose) {
      std::cout << "initial pair " << id << " " << other << ": "
                << (result.ok ? "ok" : result.reason) << ", " << result.num_inliers << " inliers, "
                << result.triangulation_angle_deg << " deg\n";
    }
    if (!result.ok) return false;
    while (submap_.Step(Sink())) continue;
    return true;
  }

  Submap::EventSink Sink() {
    return [this](const PhotoEvent& event) {
      if (event.state == PhotoEvent::State::kRegistered) AddToTable(event);
      if (!arguments_.verbose) return;
      const char* names[] = {"registered", "deferred", "rejected", "withdrawn"};
      std::cout << "  " << event.image_id << " " << names[static_cast<int>(event.state)] << " "
                << event.reason << " visible " << event.num_visible << " inliers "
                << event.num_inliers << " error " << event.mean_error_px << " register "
                << event.register_s << " triangulate " << event.triangulate_s << " ba "
                << event.ba_s << " (" << event.num_ba_images << ") total " << event.total_s
                << " qvec " << event.qvec.transpose() << " tvec " << event.tvec.transpose() << "\n";
    };
  }

  void AddToTable(const PhotoEvent& event) {
    if (!photo_table_.is_open()) return;
    photo_table_ << before_.size() << "," << event.image_id << ","
                 << submap_.map().reconstruction().NumRegImages() << "," << event.num_ba_images
                 << "," << event.ba_s << "," << event.ba_cpu_s << "," << event.mean_error_px << ","
                 << event.total_s << std::endl;
  }

  void Print(const std::string& when, size_t num_photos, double seconds) const {
    const SubmapStatistics s = submap_.Statistics();
    std::cout << when << ": registered " << s.num_images << "/" << num_photos << " points "
              << s.num_points << " MRE " << s.mean_reprojection_error_px << " MTL "
              << s.mean_track_length << " RMSE% "
              << PositionRmsePercent(submap_.map().reconstruction(), truth_) << " cpu_s " << seconds
              << " per photo " << seconds / num_photos << "\n";
    for (const auto& [id, state] : submap_.map().camera_states()) {
      std::cout << "  camera " << id << ": "
                << submap_.map().reconstruction().Camera(id).ParamsToString() << "\n";
    }
  }

  void Write(const std::string& folder) const {
    std::filesystem::create_directories(folder);
    submap_.map().reconstruction().Write(folder);
  }

  const Arguments arguments_;
  Submap submap_;
  std::vector<ImageId> before_;
  std::map<std::pair<ImageId, ImageId>, double> angle_deg_;  // of initial pairs; 0: of no use
  std::map<ImageId, DistancesOfPhoto> candidates_;
  std::map<std::string, Eigen::Vector3d> truth_;
  std::ofstream photo_table_;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  CLI::App app("Feeds a COLMAP database photo by photo to Skein's mapper");
  app.add_option("--database", arguments.database, "COLMAP database with verified matches")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--order", arguments.order, "name, id (as they came) or shuffle:SEED");
  app.add_option("--ground-truth", arguments.ground_truth, "folder of Strecha's .camera files");
  app.add_option("--reference", arguments.reference, "COLMAP model to compare positions with");
  app.add_option("--output", arguments.output, "folder for the finished model");
  app.add_option("--output-before", arguments.output_before, "folder for the model before finish");
  app.add_option("--photo-table", arguments.photo_table,
                 "file for a line of CSV a registered photo: its local BA");
  app.add_option("--local-ba", arguments.local_ba.form, "local bundle adjustment")
      ->check(CLI::IsMember(skein::LocalBaForms()))
      ->capture_default_str();
  app.add_option("--camera-model", arguments.camera_model, "one of COLMAP's");
  app.add_option("--local-ba-images", arguments.local_ba.colmap_images,
                 "images of --local-ba colmap")
      ->check(CLI::Range(3, 1000))
      ->capture_default_str();
  app.add_option("--max-pairs", arguments.max_pairs,
                 "pairs with earlier photos that count, best first; 0: all");
  app.add_flag("!--no-global-ba", arguments.global_ba,
               "no global BA after the first photos, until finish");
  app.add_option("--focal-factor", arguments.focal_factor, "multiplies the focal prior");
  app.add_option("--threads", arguments.threads, "threads of a bundle adjustment");
  app.add_option("--max-photos", arguments.max_photos, "stop after this many; 0: all");
  app.add_flag("--background", arguments.background, "global BA beside registration");
  app.add_flag("--verbose", arguments.verbose, "tell about each photo");
  CLI11_PARSE(app, argc, argv);
  try {
    return skein::Run(arguments).Execute();
  } catch (const std::exception& error) {
    std::cerr << "mapper_offline: " << error.what() << "\n";
    return 1;
  }
}
