#include "dense/dense_service.h"

#include <algorithm>
#include <exception>
#include <stdexcept>

#include "core/clock.h"
#include "core/counted.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/threads.h"
#include "event_loop/exit_signal.h"

namespace skein {
namespace {

constexpr double kTellS = 1;  // period of points that have changed
constexpr double kAgainS = 5;
constexpr char kStep[] = "depth map";
constexpr int kNiceness = 19;  // photos are placed first

LiveMeshOptions MeshOptionsOf(const DenseOptions& options) {
  LiveMeshOptions mesh;
  mesh.max_bytes = int64_t{options.surface_memory_mib} << 20;
  return mesh;
}

DenseManifest ManifestOf(const std::map<uint32_t, DensePhotoPoints>& points,
                         const DenseManifest::Mesh& mesh) {
  DenseManifest manifest;
  manifest.mesh = mesh;
  for (const auto& [id, photo] : points) {
    manifest.photos.push_back({id, photo.scale, photo.share, {}});
    for (const DensePhotoPoints::Chunk& chunk : photo.chunks) {
      manifest.photos.back().chunks.push_back(
          {chunk.id, chunk.version, chunk.num_points, chunk.blob_id});
    }
  }
  return manifest;
}

}  // namespace

DenseService::DenseService(Node& node, const DenseOptions& options)
    : node_(node),
      options_(options),
      failed_(node.options().session_dir, node.steps().left(), PreviousExitSignal()),
      maps_(options.size_px, int64_t{options.memory_mib} << 20,
            [this] { worker_->NoteProgress(); }),
      mesh_(MeshOptionsOf(options)),
      left_out_(failed_.LeftOut()) {
  worker_ = std::make_unique<WorkerThread>(node.loop());
  worker_->Run([this] { Prepare(); }, [] {});
  shapes_ = std::make_unique<ShapeFollower>(node, store_, FollowShapes());
  follower_ = std::make_unique<LedgerFollower>(node, 1, [this](const Fact& fact) { OnFact(fact); });
  timers_ = {node.loop().AddTimer(kTellS, [this] { TakeSnapshot(); }),
             node.loop().AddTimer(kAgainS, [this] { TellAgain(); })};
  node.OnHeartbeat([this](heartbeat_t* heartbeat) {
    int64_t num_points = 0;
    for (const auto& [id, told] : told_) num_points += told.message.num_points;
    heartbeat->ledger_seq = follower_->processed_seq();
    heartbeat->backlog = static_cast<int32_t>(num_waiting_);
    heartbeat->num_done = num_done_;
    heartbeat->mean_s = num_done_ == 0 ? 0.F : static_cast<float>(sum_s_ / num_done_);
    heartbeat->state = Counted(num_points, "dense point");
  });
}

// On the worker: the loop keeps its priority, as its sign of life is waited for.
void DenseService::Prepare() {
  SetNicenessOfThread(kNiceness);
  Result<std::unique_ptr<PhotoDecoder>> decoder = PhotoDecoder::Start(options_.decoder);
  if (!decoder.ok()) throw std::runtime_error(decoder.error());
  decoder_ = *std::move(decoder);
}

DenseService::~DenseService() {
  for (const auto timer : timers_) node_.loop().CancelTimer(timer);
}

ShapeFollowerOptions DenseService::FollowShapes() {
  ShapeFollowerOptions options = FollowLiveSubmaps(state_);
  options.on_shape = [this](int64_t submap_id, uint64_t) {
    changed_.insert(submap_id);
    Go();
  };
  return options;
}

void DenseService::OnFact(const Fact& fact) {
  state_.Apply(fact);
  const auto* end = std::get_if<submap_end_t>(&fact);
  if (end == nullptr) return;
  store_.Drop(end->submap_id);
  Forget(end->submap_id);
  changed_.erase(end->submap_id);
  ended_.insert(end->submap_id);
  Go();
}

// One step of the worker at a time: shapes that came, then the next photo.
void DenseService::Go() {
  if (working_) return;
  working_ = true;
  std::vector<ShapePtr> shapes;
  for (const int64_t id : std::exchange(changed_, {})) {
    const ShapePtr shape = store_.Find(id);
    if (shape != nullptr && state_.IsLive(id)) shapes.push_back(KnownPhotosOf(*shape));
  }
  worker_->Run(
      [this, shapes, live = LiveSubmaps(), ended = std::exchange(ended_, {}),
       left_out = std::exchange(left_out_, {})] {
        has_new_maps_ |= !left_out.empty() || !ended.empty();
        for (const uint32_t id : left_out) maps_.LeaveOut(id);
        for (const int64_t id : ended) {
          maps_.DropSubmap(id);
          mesh_.Drop(id);
        }
        return MakePlan(shapes, live);
      },
      [this](const Plan& plan) { OnPlan(plan); });
}

// A shape may name photos that are none.
ShapePtr DenseService::KnownPhotosOf(const Shape& shape) const {
  auto known = std::make_shared<Shape>(shape);
  known->photos.clear();
  for (const ShapePhoto& photo : shape.photos) {
    if (state_.FindPhoto(photo.image_id) != nullptr) known->photos.push_back(photo);
  }
  return known;
}

DenseService::Plan DenseService::MakePlan(const std::vector<ShapePtr>& shapes,
                                          const std::vector<int64_t>& live) {
  has_new_maps_ |= !shapes.empty();
  for (const ShapePtr& shape : shapes) {
    const Status taken = maps_.Update(*shape);
    if (!taken.ok()) LogWarn("submap {}: {}", shape->submap_id, taken.error());
  }
  Plan plan{maps_.Next(), {}, false};
  if (plan.task) return plan;
  if (const auto id = maps_.NextToRefine()) {
    plan.goes_on = has_new_maps_ = true;
    if (!Try(*id, [&] { maps_.Refine(*id, NowUs()); })) plan.failed.push_back(*id);
  } else {
    plan.goes_on = GrowMesh(live);
  }
  return plan;
}

// A step of the mesh, while nothing else is to do. False: the mesh is complete.
bool DenseService::GrowMesh(const std::vector<int64_t>& live) {
  if (options_.surface_memory_mib == 0) return false;
  if (std::exchange(has_new_maps_, false)) {
    for (const int64_t id : live) mesh_.Update(id, maps_.ConfirmedOf(id));
  }
  worker_->NoteProgress();
  return mesh_.Step(NowUs());
}

void DenseService::OnPlan(const Plan& plan) {
  NoteFailures(plan.failed);
  if (plan.task) return Gather(*plan.task);
  working_ = false;
  if (plan.goes_on || !changed_.empty() || !ended_.empty() || !left_out_.empty()) Go();
}

void DenseService::Gather(DenseTask task) {
  const auto gathering = std::make_shared<Gathering>();
  gathering->task = std::move(task);
  gathering->num_missing = gathering->task.wanted.size();
  if (gathering->num_missing == 0) return MakeMap(gathering);
  for (const uint32_t id : gathering->task.wanted) {
    const auto take = [this, gathering, id](Result<Bytes> photo) {
      gathering->photos.emplace(id, std::move(photo));
      if (--gathering->num_missing == 0) MakeMap(gathering);
    };
    const PhotoState* photo = state_.FindPhoto(id);
    if (photo == nullptr) {
      node_.loop().Post([take] { take(NotFound("the ledger has no such photo")); });
    } else {
      node_.blobs().Fetch(photo->image.blob_id, "ingest", take);
    }
  }
}

void DenseService::MakeMap(const std::shared_ptr<Gathering>& gathering) {
  worker_->Run([this, gathering] { return Make(*gathering); },
               [this](const Made& made) { OnMade(made); });
}

DenseService::Made DenseService::Make(const Gathering& gathering) {
  constexpr int kRefinedAfterMap = 2;
  const Timer timer;
  Made made;
  const auto attempt = [&](uint32_t id, const std::function<void()>& work) {
    if (!Try(id, work)) made.failed.push_back(id);
  };
  for (const auto& [id, photo] : gathering.photos) {
    if (!photo.ok()) {
      LogWarn("image {}: {}", id, photo.error());  // it is wanted again with the next shape
    } else if (!Decode(id, *photo)) {
      made.failed.push_back(id);
    }
  }
  const DenseTask& task = gathering.task;
  has_new_maps_ = true;
  attempt(task.image_id, [&] { maps_.Make(task, NowUs()); });
  for (int i = 0; i < kRefinedAfterMap; ++i) {
    if (const auto id = maps_.NextToRefine()) attempt(*id, [&] { maps_.Refine(*id, NowUs()); });
  }
  made.seconds = timer.ElapsedS();
  return made;
}

// False: it threw. A crash counts against the photo by the record of steps.
bool DenseService::Try(uint32_t image_id, const std::function<void()>& work) {
  worker_->NoteProgress();
  const StepRecord::Scope scope(&node_.steps(), 0, {image_id, kStep});
  try {
    work();
    return true;
  } catch (const std::exception& error) {
    LogWarn("image {}: {}", image_id, error.what());
    return false;
  }
}

// False: the photo is to blame. Where no decoder can be started, it is wanted again with the next
// shape.
bool DenseService::Decode(uint32_t image_id, const Bytes& photo) {
  Status status;
  const bool is_done = Try(image_id, [&] {
    const Result<DecodedPhoto> decoded = decoder_->Decode(photo, options_.size_px);
    status = decoded.ok() ? maps_.SetPhoto(image_id, cv::Mat3b(decoded->image)) : decoded.status();
  });
  if (!status.ok()) LogWarn("image {}: {}", image_id, status.error());
  return is_done && (status.ok() || status.code == StatusCode::kUnavailable);
}

void DenseService::OnMade(const Made& made) {
  working_ = false;
  ++num_done_;
  sum_s_ += made.seconds;
  NoteFailures(made.failed);
  Go();
}

void DenseService::NoteFailures(const std::vector<uint32_t>& failed) {
  for (const uint32_t id : failed) {
    if (failed_.Note(id)) left_out_.push_back(id);
  }
}

// ---- What is published ----

std::vector<int64_t> DenseService::LiveSubmaps() const {
  std::vector<int64_t> live;
  for (const auto& [id, submap] : state_.submaps()) {
    if (!submap.ended) live.push_back(id);
  }
  return live;
}

void DenseService::TakeSnapshot() {
  if (worker_->num_pending() > 1) return;  // the last snapshot waits still
  worker_->Run(
      [this, live = LiveSubmaps(), told = told_changes_] {
        Snapshot snapshot;
        snapshot.num_waiting = maps_.num_waiting();
        snapshot.changes = maps_.changes() + mesh_.changes();
        if (snapshot.changes == told) return snapshot;
        for (const int64_t id : live) {
          snapshot.surfaces[id] = {maps_.PointsOfSubmap(id), mesh_.MeshOfSubmap(id)};
        }
        return snapshot;
      },
      [this](Snapshot snapshot) { OnSnapshot(std::move(snapshot)); });
}

void DenseService::OnSnapshot(Snapshot snapshot) {
  num_waiting_ = snapshot.num_waiting;
  told_changes_ = snapshot.changes;
  for (const auto& [submap_id, surface] : snapshot.surfaces) {
    if (state_.IsLive(submap_id)) Tell(submap_id, surface);
  }
}

void DenseService::Tell(int64_t submap_id, const Surface& surface) {
  DenseManifest manifest = ManifestOf(surface.points, surface.mesh.list);
  Told& told = told_[submap_id];
  Bytes content = EncodeDenseManifest(manifest);
  if (content == told.content) return;
  told.content = std::move(content);
  last_version_ = std::max(NowUs(), last_version_ + 1);
  manifest.version = static_cast<uint64_t>(last_version_);
  auto bytes = std::make_shared<const Bytes>(EncodeDenseManifest(manifest));
  dense_points_t& message = told.message;
  message.author = node_.instance();
  message.submap_id = submap_id;
  message.version = last_version_;
  message.num_photos = static_cast<int32_t>(manifest.photos.size());
  message.num_points = manifest.NumPoints();
  message.manifest_blob = HashBytes(bytes->data(), bytes->size());
  message.manifest_bytes = static_cast<int64_t>(bytes->size());
  Blobs blobs{{message.manifest_blob, std::move(bytes)}};
  blobs.insert(surface.mesh.blobs.begin(), surface.mesh.blobs.end());
  for (const auto& [id, photo] : surface.points) {
    for (const DensePhotoPoints::Chunk& chunk : photo.chunks) blobs[chunk.blob_id] = chunk.bytes;
  }
  LogNew(manifest);
  for (const auto& [id, blob] : blobs) node_.blobs().Keep(id, blob);
  for (const auto& [id, blob] : told.previous) node_.blobs().Release(id);
  told.previous = std::exchange(told.blobs, std::move(blobs));
  node_.Publish(kDensePointsChannel, message);
}

// For benchmark/live/while_captured.sh.
void DenseService::LogNew(const DenseManifest& manifest) {
  for (const DenseManifest::Photo& photo : manifest.photos) {
    const PhotoState* known = state_.FindPhoto(photo.image_id);
    if (known == nullptr || !shown_.insert(photo.image_id).second) continue;
    LogDebug("image {}: its surface is shown {:.3f} s after its receipt", photo.image_id,
             1e-6 * static_cast<double>(NowUs() - known->image.header.utime_us));
  }
}

void DenseService::TellAgain() {
  for (const auto& [id, told] : told_) {
    if (!told.message.manifest_blob.empty()) node_.Publish(kDensePointsChannel, told.message);
  }
}

void DenseService::Forget(int64_t submap_id) {
  const auto told = told_.find(submap_id);
  if (told == told_.end()) return;
  for (const Blobs* blobs : {&told->second.blobs, &told->second.previous}) {
    for (const auto& [id, blob] : *blobs) node_.blobs().Release(id);
  }
  told_.erase(told);
}

}  // namespace skein
