// mapper_offline: feeds a COLMAP database photo by photo to the mapper, without services, and
// tells what came of it. For measuring the mapper against `colmap mapper` on the same matches.

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "disambiguation/similar_structures.h"
#include "geometry/model_poses.h"
#include "geometry/pose_evaluation.h"
#include "mapping/rebuild.h"
#include "mapping/submap.h"
#include "matching/two_view.h"
#include "merger/seed_policy.h"
#include "merging/submap_merge.h"
#include "sfm/database.h"
#include "sfm/model_files.h"
#include "testing/test_ledger.h"

namespace skein {
namespace {

struct Arguments {
  std::string database, order = "name", truth, output;
  std::string camera_model = "auto";
  int local_ba_images = skein::SubmapOptions().local_ba_images;
  std::string output_before, photo_table, model;
  size_t max_pairs = 30;
  bool global_ba = true;
  double focal_factor = 1.0;
  int threads = 1;
  int max_photos = 0;
  bool background = false;
  bool verbose = false;
  bool batch = false;
  bool global = false;
  int parts = 0;
};

double CpuSeconds() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_utime.tv_sec + usage.ru_utime.tv_usec * 1e-6 + usage.ru_stime.tv_sec +
         usage.ru_stime.tv_usec * 1e-6;
}

std::vector<Image> OrderedImages(const ColmapDatabase& database, const Arguments& arguments) {
  std::vector<Image> images = database.ReadAllImages();
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

PhotoInput ReadPhoto(const ColmapDatabase& database, const Image& image,
                     const Arguments& arguments) {
  const Camera camera = database.ReadCamera(image.CameraId());
  PhotoInput photo;
  photo.image_id = image.ImageId();
  photo.camera_id = image.CameraId();
  photo.name = image.Name();
  photo.width_px = static_cast<int>(camera.Width());
  photo.height_px = static_cast<int>(camera.Height());
  photo.focal_px = camera.MeanFocalLength() * arguments.focal_factor;
  photo.focal_from_exif = camera.HasPriorFocalLength();
  photo.keypoints = database.ReadKeypoints(image.ImageId());
  return photo;
}

// Verified pairs with the photos that came before, most inliers first.
TwoViewPairs ReadPairs(const ColmapDatabase& database, ImageId id,
                       const std::vector<ImageId>& before, size_t max_pairs) {
  TwoViewPairs pairs;
  for (const ImageId other : before) {
    if (!database.ExistsInlierMatches(id, other)) continue;
    const TwoViewGeometry geometry = database.ReadTwoViewGeometry(id, other);
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

CameraPose PoseOf(const Image& image) {
  const Eigen::Vector4d& q = image.Qvec();
  return {Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized(), image.Tvec()};
}

ModelPoses PosesOf(const Reconstruction& reconstruction) {
  ModelPoses model;
  for (const ImageId id : reconstruction.RegImageIds()) {
    const Image& image = reconstruction.Image(id);
    model.poses.push_back({image.Name(), PoseOf(image)});
  }
  return model;
}

ModelPoses ReadTruth(const std::string& path) {
  Result<ModelPoses> poses = ReadPoses(path);
  if (!poses.ok()) throw std::runtime_error(path + ": " + poses.error());
  return *std::move(poses);
}

// As the matching service has it.
Camera PriorOf(const PhotoInput& photo) {
  return PriorCamera(photo.width_px, photo.height_px, photo.focal_px, photo.focal_from_exif);
}

std::vector<Eigen::Vector2d> PixelsOf(const PhotoInput& photo) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Keypoint& k : photo.keypoints) pixels.emplace_back(k.x, k.y);
  return pixels;
}

// The services' way to an initial pair: matching measures each verified pair, the merger's policy
// chooses one.
class Seeds {
 public:
  void OnMatches(const PhotoInput& photo, const TwoViewPairs& pairs) {
    std::vector<two_view_t> verified;
    for (const TwoViewPair& pair : pairs) verified.push_back(Measure(photo, pair));
    photos_[photo.image_id] = photo;
    ledger_.Matches(photo.image_id, verified);
  }

  // Each pair once. `finishing`: no photo comes any more.
  std::optional<SeedChoice> Choose(bool finishing) {
    SeedSituation situation;
    situation.finishing = finishing;
    situation.head_seq = ledger_.head();
    const std::optional<SeedChoice> choice = policy_.Choose(directory_, situation);
    if (choice) {
      ledger_.Seed(++num_seeds_, choice->image_id1, choice->image_id2);
      ledger_.End(num_seeds_);
    }
    return choice;
  }

 private:
  two_view_t Measure(const PhotoInput& photo, const TwoViewPair& pair) const {
    const PhotoInput& other = photos_.at(pair.other_id);
    FeatureMatches matches;
    for (const auto& [index, other_index] : pair.inliers) matches.emplace_back(index, other_index);
    const TwoViewGeometry geometry =
        EstimateTwoView(PriorOf(photo), PixelsOf(photo), PriorOf(other), PixelsOf(other), matches,
                        static_cast<uint32_t>(photo.image_id));
    return TestLedger::Pair(pair.other_id, static_cast<int>(geometry.inlier_matches.size()),
                            static_cast<float>(geometry.tri_angle),
                            static_cast<float>(ForwardMotion(geometry)));
  }

  SeedPolicy policy_;
  TestLedger ledger_;
  SubmapDirectory directory_{ledger_.state()};
  std::map<int64_t, PhotoInput> photos_;
  int64_t num_seeds_ = 0;
};

class Run {
 public:
  explicit Run(const Arguments& arguments) : arguments_(arguments), submap_(Options(arguments)) {
    if (!arguments.truth.empty()) truth_ = ReadTruth(arguments.truth);
    if (!arguments.photo_table.empty()) {
      photo_table_.open(arguments.photo_table);
      photo_table_ << "photo,image_id,map_images,ba_images,ba_s,ba_cpu_s,error_px,total_s\n";
    }
  }

  int Execute() {
    const ColmapDatabase database(arguments_.database);
    const std::vector<Image> images = OrderedImages(database, arguments_);
    double mapper_s = 0;
    for (const Image& image : images) {
      const PhotoInput photo = ReadPhoto(database, image, arguments_);
      const TwoViewPairs pairs =
          ReadPairs(database, image.ImageId(), before_, arguments_.max_pairs);
      before_.push_back(image.ImageId());
      if (arguments_.model.empty() && !IsStarted()) seeds_.OnMatches(photo, pairs);
      const double start = CpuSeconds();
      Feed(photo, pairs);
      if (!IsStarted()) TryToStart(false);
      mapper_s += CpuSeconds() - start;
    }
    if (!IsStarted()) TryToStart(true);
    if (!arguments_.model.empty()) TakeModel();
    Print("before finish", images.size(), mapper_s);
    PrintAgreement();
    if (!arguments_.output_before.empty()) Write(arguments_.output_before);
    double start = CpuSeconds();
    while (arguments_.background &&
           submap_.Maintain(std::numeric_limits<double>::infinity(), Sink())) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (arguments_.background) Print("at rest", images.size(), CpuSeconds() - start);
    start = CpuSeconds();
    if (arguments_.global) PrintGlobal(images.size());
    const auto absorb = [this](const Submap& anew) {
      return AbsorbBatch(anew, &submap_).status.ok();
    };
    if (arguments_.batch) submap_.MapAsBatch({true, {}, absorb}, Sink());
    submap_.Finish(Sink(), {true, absorb});
    Print("after finish", images.size(), CpuSeconds() - start);
    PrintAgreement();
    if (arguments_.parts > 1) PrintParts();
    if (!arguments_.output.empty()) Write(arguments_.output);
    return 0;
  }

 private:
  static SubmapOptions Options(const Arguments& arguments) {
    SubmapOptions options;
    options.camera_model = arguments.camera_model;
    options.local_ba_images = arguments.local_ba_images;
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
    if (!IsStarted()) return;
    submap_.Enqueue(photo.image_id);
    while (submap_.Step(Sink())) continue;
  }

  // Goes on from a model that an earlier run wrote.
  void TakeModel() {
    const Result<Reconstruction> read = ReadModelFiles(arguments_.model);
    if (!read) throw std::runtime_error(read.error());
    const Reconstruction& model = *read;
    SubmapState state = submap_.State();
    state.first = model.RegImageIds().front();
    const Status status = submap_.Restore(model, state);
    if (!status.ok()) throw std::runtime_error(arguments_.model + ": " + status.error());
  }

  void PrintGlobal(size_t num_photos) const {
    const double start = CpuSeconds();
    const auto anew = MapAnew(submap_, submap_.map().photos().front(), true, false);
    if (anew == nullptr) {
      std::cout << "global: nothing\n";
      return;
    }
    anew->Finish([](const PhotoEvent&) {});
    const SubmapStatistics s = anew->Statistics();
    const Result<PoseEvaluation> evaluation =
        EvaluatePoses(PosesOf(anew->map().reconstruction()), truth_);
    std::cout << "global: registered " << s.num_images << "/" << num_photos << " points "
              << s.num_points << " MRE " << s.mean_reprojection_error_px << " RMSE% "
              << (evaluation.ok() ? evaluation->PositionPercent(evaluation->position.rmse) : NAN)
              << " agreeing "
              << CountMatches(anew->options(), anew->map(), anew->waiting()).agreeing << " cpu_s "
              << CpuSeconds() - start << "\n";
  }

  void PrintAgreement() const {
    const MatchAgreement agreement =
        CountMatches(submap_.options(), submap_.map(), submap_.waiting());
    std::cout << "  matches that agree " << agreement.agreeing << ", to win " << agreement.to_win
              << "\n";
  }

  // Photos that share most matches lie side by side: by the second eigenvector of the normalised
  // Laplacian of the verified pairs (Shi and Malik 2000).
  std::vector<ImageId> PhotosByTies() const {
    const SceneMap& map = submap_.map();
    const std::vector<ImageId>& ids = map.reconstruction().RegImageIds();
    const auto n = static_cast<Eigen::Index>(ids.size());
    Eigen::MatrixXd ties = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::map<ImageId, int>& neighbours = map.Neighbours(ids[i]);
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto found = neighbours.find(ids[j]);
        if (found != neighbours.end()) ties(i, j) = found->second;
      }
    }
    const Eigen::VectorXd scale = ties.rowwise().sum().cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * ties *
                                                               scale.asDiagonal());
    const Eigen::VectorXd second = scale.cwiseProduct(eigen.eigenvectors().col(n - 2));
    std::vector<Eigen::Index> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return second[a] < second[b]; });
    std::vector<ImageId> sorted;
    for (const Eigen::Index i : order) sorted.push_back(ids[i]);
    return sorted;
  }

  // Cells between two sets, and how many pairs of photos with 20 cells or more tell another place.
  void PrintCells(const std::string& what, const std::set<ImageId>& photos1,
                  const std::set<ImageId>& photos2) const {
    const SceneMap& map = submap_.map();
    CellVotes sum;
    int num_pairs = 0, num_missing = 0, num_different = 0;
    for (const auto& [id1, id2] : map.pairs()) {
      const bool is_between = (photos1.count(id1) > 0 && photos2.count(id2) > 0) ||
                              (photos2.count(id1) > 0 && photos1.count(id2) > 0);
      if (!is_between) continue;
      const CellVotes cells = ComparePair(map, map.reconstruction(), id1, id2);
      sum.Add(cells);
      constexpr int kMinCells = 20;
      num_pairs += cells.num_cells() >= kMinCells;
      num_missing += HasTooManyMissingCells(cells, kMinCells);
      num_different += ShowsAnotherPlace(cells, kMinCells);
    }
    std::cout << "  " << what << ": of " << sum.num_cells() << " cells missing " << sum.num_missing
              << " different " << sum.num_different << "; of " << num_pairs
              << " pairs above 0.4 missing " << num_missing << ", above 0.15 different "
              << num_different << "\n";
  }

  // Whether parts of one place would be taken for places of their own.
  void PrintParts() const {
    const SceneMap& map = submap_.map();
    const std::vector<ImageId> ids = PhotosByTies();
    for (int part = 0; part < arguments_.parts; ++part) {
      const auto begin = ids.begin() + part * ids.size() / arguments_.parts;
      const auto end = ids.begin() + (part + 1) * ids.size() / arguments_.parts;
      const std::set<ImageId> ours(begin, end);
      std::set<ImageId> others(ids.begin(), begin);
      others.insert(end, ids.end());
      std::cout << "part " << part + 1 << " of " << arguments_.parts << ": " << ours.size()
                << " photos " << ComparePlaces(map, map.reconstruction(), ours, others).reason
                << "\n";
      PrintCells("across", ours, others);
      PrintCells("within", ours, ours);
      PrintCells("within the others", others, others);
    }
  }

  bool IsStarted() const { return submap_.map().reconstruction().NumRegImages() > 0; }

  // With what the photos so far offer.
  void TryToStart(bool finishing) {
    while (const std::optional<SeedChoice> seed = seeds_.Choose(finishing)) {
      if (Start(*seed)) return;
    }
  }

  bool Start(const SeedChoice& seed) {
    const InitialPairResult result =
        submap_.Start(OptionsOfSeed(seed.num_inliers, seed.tri_angle_rad), seed.image_id1,
                      seed.image_id2, Sink());
    if (arguments_.verbose) {
      std::cout << "initial pair " << seed.image_id1 << " " << seed.image_id2 << ": "
                << (result.status.ok() ? "ok" : result.status.error()) << ", " << result.num_inliers
                << " inliers, " << result.triangulation_angle_deg << " deg\n";
    }
    if (!result.status.ok()) return false;
    while (submap_.Step(Sink())) continue;
    return true;
  }

  Submap::EventSink Sink() {
    return [this](const PhotoEvent& event) {
      if (event.state == PhotoEvent::State::kRegistered) AddToTable(event);
      if (!arguments_.verbose) return;
      const char* names[] = {"registered", "deferred", "rejected", "withdrawn"};
      std::cout << "  " << event.image_id << " " << names[static_cast<int>(event.state)] << " "
                << event.refusal.text << " visible " << event.num_visible << " inliers "
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
              << s.mean_track_length << " RMSE% " << PositionRmsePercent() << " sigma% "
              << 100 * s.check.shape.position_sigma << " weakest " << s.check.shape.loose_image
              << "-" << s.check.shape.anchor_image << " contradicting "
              << s.check.matches.num_contradicting << "/" << s.check.matches.num_matches
              << " cpu_s " << seconds << " per photo " << seconds / num_photos << "\n";
    for (const auto& [id, state] : submap_.map().camera_states()) {
      std::cout << "  camera " << id << ":";
      for (const double param : submap_.map().reconstruction().Camera(id).Params()) {
        std::cout << " " << param;
      }
      std::cout << "\n";
    }
  }

  // Of the largest distance between two photos of the truth.
  double PositionRmsePercent() const {
    const Result<PoseEvaluation> evaluation =
        EvaluatePoses(PosesOf(submap_.map().reconstruction()), truth_);
    return evaluation.ok() ? evaluation->PositionPercent(evaluation->position.rmse) : NAN;
  }

  void Write(const std::string& folder) const {
    std::filesystem::create_directories(folder);
    const Status written = WriteModelBinary(submap_.map().reconstruction(), folder);
    if (!written.ok()) throw std::runtime_error(written.error());
  }

  const Arguments arguments_;
  Submap submap_;
  std::vector<ImageId> before_;
  Seeds seeds_;
  ModelPoses truth_;
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
  app.add_option("--truth", arguments.truth,
                 "poses to compare positions with: what `skein evaluate` takes");
  app.add_option("--output", arguments.output, "folder for the finished model");
  app.add_option("--output-before", arguments.output_before, "folder for the model before finish");
  app.add_option("--photo-table", arguments.photo_table,
                 "file for a line of CSV a registered photo: its local BA");
  app.add_option("--model", arguments.model,
                 "goes on from this COLMAP model of all the photos, instead of mapping them")
      ->check(CLI::ExistingDirectory);
  app.add_option("--camera-model", arguments.camera_model, "auto, or one of COLMAP's");
  app.add_option("--local-ba-images", arguments.local_ba_images, "images of a local BA")
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
  app.add_flag("--batch", arguments.batch, "maps all photos as a batch before the finish");
  app.add_flag("--global", arguments.global, "maps all photos globally, too, and tells of it");
  app.add_option(
      "--parts", arguments.parts,
      "cuts the final map where photos share fewest matches, and tells whether its parts "
      "would be taken for two places");
  app.add_flag("--verbose", arguments.verbose, "tell about each photo");
  CLI11_PARSE(app, argc, argv);
  try {
    return skein::Run(arguments).Execute();
  } catch (const std::exception& error) {
    std::cerr << "mapper_offline: " << error.what() << "\n";
    return 1;
  }
}
