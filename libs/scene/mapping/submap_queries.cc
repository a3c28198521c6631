// What a submap tells of itself.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "map/shared_images.h"
#include "mapping/submap.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

// Of the work that visits all matches, on one core: judging the photos, and triangulating again.
constexpr double kJudgeS = 0.01, kTriangulateS = 0.015;
constexpr int kFinalGlobalBas = 3;

// Of the photo's own observations as the map stands.
double MeanErrorPx(const SceneMap& map, ImageId id) {
  const Image& image = map.reconstruction().Image(id);
  const Camera& camera = map.reconstruction().Camera(image.CameraId());
  double sum = 0;
  int count = 0;
  for (const Point2D& point2D : image.Points2D()) {
    if (!point2D.HasPoint3D()) continue;
    const Eigen::Vector3d& xyz = map.reconstruction().Point3D(point2D.Point3DId()).XYZ();
    const double squared =
        CalculateSquaredReprojectionError(point2D.XY(), xyz, image.Qvec(), image.Tvec(), camera);
    if (squared == std::numeric_limits<double>::max()) continue;  // behind the camera
    sum += std::sqrt(squared);
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

}  // namespace

PhotoEvent Submap::RegisteredEvent(ImageId id, const PoseEstimate& estimate) const {
  PhotoEvent event;
  event.image_id = id;
  event.state = PhotoEvent::State::kRegistered;
  event.num_visible = estimate.num_visible;
  event.num_inliers = estimate.num_inliers;
  event.qvec = map_->reconstruction().Image(id).Qvec();
  event.tvec = map_->reconstruction().Image(id).Tvec();
  event.mean_error_px = MeanErrorPx(*map_, id);
  return event;
}

SharedImages Submap::ExportShared(const std::vector<int64_t>& image_ids) {
  const auto guests = PlaceGuests(image_ids);
  return SharedImagesOf(map_->reconstruction(), image_ids);
}

// Two places may share an object of one design, and photos that see it match. So a photo of another
// submap is judged by what it misses, too. One that sees few points follows its neighbours.
std::unique_ptr<GuestPhotos> Submap::PlaceGuests(const std::vector<int64_t>& image_ids) {
  auto guests = std::make_unique<GuestPhotos>(map_.get());
  found_poses_.BeginNext();
  struct Candidate {
    ImageId id;
    TrialContext context;
    std::pair<bool, size_t> rank;  // its pose is known; points that it sees
  };
  std::vector<Candidate> left;
  const auto rank_all = [&] {
    for (auto& [id, context, rank] : left) {
      const VisiblePoints visible = FindVisiblePoints(*map_, id);
      rank = {found_poses_.Knows(*map_, id, visible, context), visible.size()};
    }
  };
  for (const int64_t image_id : image_ids) {
    if (!map_->HasPhoto(image_id) || map_->IsRegistered(image_id)) continue;
    if (waiting_.left_out().count(image_id) > 0) continue;
    const ImageId id = static_cast<ImageId>(image_id);
    left.push_back({id, waiting_.ContextOf(id), {}});
    left.back().context.matches_similar_place = true;
  }
  rank_all();
  while (!left.empty()) {
    const auto best = std::max_element(
        left.begin(), left.end(), [](const auto& a, const auto& b) { return a.rank < b.rank; });
    const Candidate next = *best;
    left.erase(best);
    const int num_before = guests->size();
    const auto part = options_.Enter(SubmapOptions::Part::kPhoto, next.id);
    guests->Place(next.id, next.context, &found_poses_);
    if (guests->size() > num_before) rank_all();
  }
  return guests;
}

std::vector<int64_t> Submap::FindGuests(const Reconstruction& other, int max_num) const {
  std::map<ImageId, int> num_matches;  // with registered photos and with guests
  const auto count_with = [&](ImageId id) {
    for (const auto& [neighbour, inliers] : map_->Neighbours(id)) {
      const auto candidate = num_matches.find(neighbour);
      if (candidate != num_matches.end()) candidate->second += inliers;
    }
  };
  for (const ImageId id : other.RegImageIds()) {
    if (map_->HasPhoto(id) && !map_->IsRegistered(id)) num_matches[id] = 0;
  }
  for (const ImageId id : map_->reconstruction().RegImageIds()) count_with(id);
  std::vector<int64_t> guests;
  while (static_cast<int>(guests.size()) < max_num) {
    const auto best =
        std::max_element(num_matches.begin(), num_matches.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (best == num_matches.end() || best->second == 0) break;
    const ImageId id = best->first;
    guests.push_back(id);
    num_matches.erase(best);
    count_with(id);
  }
  return guests;
}

std::vector<PhotoEvent> Submap::RegisteredEvents() const {
  std::vector<ImageId> ids = map_->reconstruction().RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::vector<PhotoEvent> events;
  for (const ImageId id : ids) {
    PoseEstimate estimate;
    estimate.num_inliers = static_cast<int>(map_->reconstruction().Image(id).NumPoints3D());
    events.push_back(RegisteredEvent(id, estimate));
  }
  return events;
}

double Submap::EstimateConsolidateS() const {
  if (settled_.checked && settled_.none_misplaced && settled_.consistent) return 0;
  return kJudgeS * map_->reconstruction().NumRegImages() + adjuster_.last_global_ba_s();
}

double Submap::EstimateFinishS() const {
  return EstimateConsolidateS() + kTriangulateS * map_->reconstruction().NumRegImages() +
         kFinalGlobalBas * adjuster_.last_global_ba_s();
}

SubmapState Submap::State() const {
  SubmapState state;
  state.photos.assign(map_->photos().begin(), map_->photos().end());
  for (const auto& [id, camera] : map_->camera_states()) {
    state.is_camera_refined[id] = camera.refined;
  }
  state.trials = waiting_.records();
  state.size_at_global = adjuster_.size_at_global();
  state.first = first_;
  return state;
}

Status Submap::Restore(const Reconstruction& model, const SubmapState& state) {
  const Status status = ReplaceModel(model);
  if (!status.ok()) return status;
  waiting_.set_records(state.trials);
  adjuster_.set_size_at_global(state.size_at_global);
  first_ = state.first;
  for (const auto& [id, is_refined] : state.is_camera_refined) {
    if (map_->camera_states().count(id) > 0) map_->SetCameraRefined(id, is_refined);
  }
  return Status::Ok();
}

SubmapStatistics Submap::Statistics() const {
  SubmapStatistics statistics;
  const Reconstruction& reconstruction = map_->reconstruction();
  statistics.num_images = static_cast<int>(reconstruction.NumRegImages());
  statistics.num_deferred = waiting_.NumDeferred();
  statistics.num_points = static_cast<int>(reconstruction.NumPoints3D());
  statistics.mean_reprojection_error_px = reconstruction.ComputeMeanReprojectionError();
  statistics.mean_track_length = reconstruction.ComputeMeanTrackLength();
  statistics.check = adjuster_.check();
  return statistics;
}

}  // namespace skein
