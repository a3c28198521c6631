#include "dense/dense_service.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/threads.h"
#include "event_loop/exit_signal.h"
#include "event_loop/step_record.h"

namespace skein {
namespace {

constexpr double kTellS = 1;  // period of points that have changed
constexpr double kAgainS = 5;
// Names of steps.
constexpr char kMapStep[] = "depth map";
constexpr char kMeshStep[] = "mesh";
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
      failed_maps_(node.options().session_dir, "dense.failed", kMapStep, node.steps().left(),
                   PreviousExitSignal()),
      failed_meshes_(node.options().session_dir, "dense_mesh.failed", kMeshStep,
                     node.steps().left(), PreviousExitSignal()),
      maps_(options.size_px, int64_t{options.memory_mib} << 20,
            [this] { worker_->NoteProgress(); }),
      mesh_(MeshOptionsOf(options)),
      left_out_(failed_maps_.LeftOut()),
      meshes_left_out_(failed_meshes_.LeftOut()) {
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
       photos = std::exchange(left_out_, {}), meshes = std::exchange(meshes_left_out_, {})] {
        has_new_maps_ |= !photos.empty() || !ended.empty();
        LeaveOut(photos, meshes);
        for (const int64_t id : ended) {
          maps_.DropSubmap(id);
          mesh_.Drop(id);
        }
        return Attempt([&] { return MakePlan(shapes, live); });
      },
      [this](const Result<Plan>& plan) {
        if (!plan.ok()) LogError("no plan until the next shape: {}", plan.error());
        OnPlan(plan.ok() ? *plan : Plan());
      });
}

void DenseService::LeaveOut(const std::vector<int64_t>& photos,
                            const std::vector<int64_t>& meshes) {
  for (const int64_t id : photos) maps_.LeaveOut(static_cast<uint32_t>(id));
  for (const int64_t id : meshes) mesh_.LeaveOut(id);
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
    const Status taken = Attempt([&] { return maps_.Update(*shape); });
    if (!taken.ok()) LogWarn("submap {}: {}", shape->submap_id, taken.error());
  }
  Plan plan;
  plan.task = maps_.Next();
  if (plan.task) return plan;
  if (const auto id = maps_.NextToRefine()) {
    plan.goes_on = has_new_maps_ = true;
    if (!Try({*id, kMapStep}, [&] { maps_.Refine(*id, NowUs()); })) plan.failed.push_back(*id);
  } else {
    plan.goes_on = GrowMesh(live, &plan.failed_meshes);
  }
  return plan;
}

// A step of the mesh, while nothing else is to do. False: the mesh is complete.
bool DenseService::GrowMesh(const std::vector<int64_t>& live, std::vector<int64_t>* failed) {
  if (options_.surface_memory_mib == 0) return false;
  std::vector<int64_t> meshed;
  std::copy_if(live.begin(), live.end(), std::back_inserter(meshed),
               [this](int64_t id) { return !mesh_.IsLeftOut(id); });
  if (std::exchange(has_new_maps_, false)) {
    for (const int64_t id : meshed) {
      const auto update = [&] { mesh_.Update(id, maps_.ConfirmedOf(id)); };
      TryMesh(id, update, failed);
    }
    if (!failed->empty()) return true;
  }
  bool is_changed = false;
  for (const int64_t id : meshed) {
    const auto step = [&] { is_changed = mesh_.Step(id, NowUs()); };
    if (!TryMesh(id, step, failed) || is_changed) return true;
  }
  return false;
}

// False: it threw. The submap's mesh then begins again.
bool DenseService::TryMesh(int64_t submap_id, const std::function<void()>& work,
                           std::vector<int64_t>* failed) {
  if (Try({submap_id, kMeshStep}, work)) return true;
  mesh_.Drop(submap_id);
  has_new_maps_ = true;
  failed->push_back(submap_id);
  return false;
}

void DenseService::OnPlan(const Plan& plan) {
  NoteFailures(plan.failed);
  NoteFailedMeshes(plan.failed_meshes);
  if (plan.task) return Gather(*plan.task);
  working_ = false;
  const bool is_told = !changed_.empty() || !ended_.empty() || !left_out_.empty();
  if (plan.goes_on || is_told) Go();
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
  worker_->Run([this, gathering] { return Attempt([&] { return Make(*gathering); }); },
               [this, id = gathering->task.image_id](const Result<Made>& made) {
                 if (!made.ok()) LogWarn("{} {}: {}", kMapStep, id, made.error());
                 OnMade(made.ok() ? *made : Made{{id}, 0});
               });
}

DenseService::Made DenseService::Make(const Gathering& gathering) {
  constexpr int kRefinedAfterMap = 2;
  const Timer timer;
  Made made;
  const auto attempt = [&](uint32_t id, const std::function<void()>& work) {
    if (!Try({id, kMapStep}, work)) made.failed.push_back(id);
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

// False: it threw. A crash counts against the item by the record of steps.
bool DenseService::Try(const Step& step, const std::function<void()>& work) {
  worker_->NoteProgress();
  const Status status = AttemptStep(&node_.steps(), 0, step, work);
  if (!status.ok()) LogWarn("{} {}: {}", step.name, step.item, status.error());
  return status.ok();
}

// False: the photo is to blame. Where no decoder can be started, it is wanted again with the next
// shape.
bool DenseService::Decode(uint32_t image_id, const Bytes& photo) {
  Status status;
  const bool is_done = Try({image_id, kMapStep}, [&] {
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
    if (failed_maps_.Note(id)) left_out_.push_back(id);
  }
}

void DenseService::NoteFailedMeshes(const std::vector<int64_t>& failed) {
  for (const int64_t id : failed) {
    if (failed_meshes_.Note(id)) meshes_left_out_.push_back(id);
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

DenseService::Snapshot DenseService::MakeSnapshot(const std::vector<int64_t>& live,
                                                  uint64_t told) const {
  Snapshot snapshot;
  snapshot.num_waiting = maps_.num_waiting();
  snapshot.changes = maps_.changes() + mesh_.changes();
  if (snapshot.changes == told) return snapshot;
  for (const int64_t id : live) {
    snapshot.surfaces[id] = {maps_.PointsOfSubmap(id), mesh_.MeshOfSubmap(id)};
  }
  return snapshot;
}

void DenseService::TakeSnapshot() {
  if (worker_->num_pending() > 1) return;  // the last snapshot waits still
  worker_->Run([this, live = LiveSubmaps(),
                told = told_changes_] { return Attempt([&] { return MakeSnapshot(live, told); }); },
               [this](const Result<Snapshot>& snapshot) {
                 Status told = snapshot.status();
                 if (told.ok()) told = Attempt([&] { OnSnapshot(*snapshot); });
                 if (!told.ok()) LogError("points are not published: {}", told.error());
               });
}

void DenseService::OnSnapshot(const Snapshot& snapshot) {
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
