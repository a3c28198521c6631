#include "retrieval/retrieval_service.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/log.h"
#include "event_loop/exit_signal.h"
#include "event_loop/step_record.h"
#include "ledger/session_folder.h"
#include "retrieval/messages.h"

namespace skein {
namespace fs = std::filesystem;
namespace {

constexpr double kTickPeriodS = 0.2;
constexpr char kStep[] = "candidates";
constexpr double kCheckpointPeriodS = 10;
constexpr double kCheckpointPause = 20;  // times what the last one took

fs::path CheckpointPath(const Node& node) {
  if (!node.shares_folder()) return {};
  return SessionPaths{node.options().session_dir}.Retrieval() / "hnsw.bin";
}

fs::path SessionOf(const fs::path& checkpoint) { return checkpoint.parent_path().parent_path(); }

// Files that a process killed while it wrote left beside the checkpoint. There is one retrieval.
void RemoveLeftovers(const fs::path& path) {
  if (path.empty()) return;
  for (const fs::path& file : FilesUnder(path.parent_path())) {
    const std::string name = file.filename();
    if (name.rfind(path.filename().string() + ".tmp-", 0) == 0) fs::remove(file);
  }
}

void WriteCheckpoint(const RetrievalState& state, const std::string& session_id,
                     const fs::path& path) {
  const fs::path root = SessionOf(path);
  Status written = CreateFoldersBelow(root, path.parent_path());
  if (written.ok()) {
    written = Attempt([&] { return WriteFileBelow(root, path, state.Encode(session_id)); });
  }
  if (!written.ok()) LogError("checkpoint not written: {}", written.error());
}

}  // namespace

RetrievalService::RetrievalService(Node& node, const RetrievalOptions& options)
    : node_(node),
      options_(options),
      checkpoint_path_(CheckpointPath(node)),
      failed_(node.options().session_dir, "retrieval.failed", kStep, node.steps().left(),
              PreviousExitSignal()) {
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
  timer_ = node.loop().AddTimer(kTickPeriodS, [this] { Tick(); });
  RemoveLeftovers(checkpoint_path_);
  Start(LoadCheckpoint());
}

RetrievalService::~RetrievalService() {
  node_.loop().CancelTimer(timer_);
  follower_.reset();
  worker_.reset();  // waits for the step that runs; those it discards are replayed
  if (!checkpoint_path_.empty() && state_->seq() > checkpoint_seq_) {
    WriteCheckpoint(*state_, node_.session_id(), checkpoint_path_);
  }
}

void RetrievalService::Start(State state) {
  state_ = std::move(state);
  start_seq_ = done_seq_ = checkpoint_seq_ = state_->seq();
  open_ = state_->unanswered();
  steps_.clear();
  caught_up_ = false;
  worker_ = std::make_unique<WorkerThread>(node_.loop());
  follower_ = std::make_unique<LedgerFollower>(
      node_, start_seq_ + 1, [this](const Fact& fact) { ChangeWhole([&] { OnFact(fact); }); });
}

RetrievalService::State RetrievalService::LoadCheckpoint() const {
  auto fresh = std::make_shared<RetrievalState>(options_);
  if (checkpoint_path_.empty()) return fresh;
  const auto bytes =
      ReadFileBelow(SessionOf(checkpoint_path_), checkpoint_path_, kMaxStoredFileBytes);
  if (bytes.code() == StatusCode::kNotFound) return fresh;
  const auto decode = [&] { return RetrievalState::Decode(*bytes, node_.session_id(), options_); };
  auto state = bytes ? Attempt(decode) : Result<RetrievalState>(bytes.status());
  if (!state) {
    LogWarn("{}: {}; rebuilding the index from the ledger", checkpoint_path_.string(),
            state.error());
    return fresh;
  }
  LogInfo("index of {} photos at ledger position {}", state->size(), state->seq());
  return std::make_shared<RetrievalState>(std::move(*state));
}

void RetrievalService::OnFact(const Fact& fact) {
  if (const auto* features = std::get_if<features_t>(&fact)) {
    OnFeatures(*features);
  } else if (const auto* registration = std::get_if<registration_t>(&fact)) {
    OnRegistration(*registration);
  } else if (const auto* failure = std::get_if<failure_t>(&fact)) {
    OnFailure(*failure);
  } else if (const auto* candidates = std::get_if<candidates_t>(&fact)) {
    ForgetAnswer(candidates->image_id);
  }
}

void RetrievalService::OnFeatures(const features_t& features) {
  const int64_t seq = features.header.seq;
  const int64_t image_id = features.image_id;
  steps_.push_back({seq, image_id, true, false, {}});
  node_.blobs().Fetch(
      features.global_blob, "ingest",
      [this, seq, image_id](const Result<Bytes>& bytes) { OnBlob(seq, image_id, bytes); });
}

void RetrievalService::OnRegistration(const registration_t& registration) {
  const int64_t image_id = registration.image_id;
  const int64_t submap_id = registration.submap_id;
  if (registration.state == registration_t::REGISTERED) {
    steps_.push_back({registration.header.seq, image_id, false, true,
                      [=](RetrievalState* state) -> std::optional<Candidates> {
                        state->NoteRegistered(image_id, submap_id);
                        return std::nullopt;
                      }});
  } else if (registration.state == registration_t::WITHDRAWN) {
    steps_.push_back({registration.header.seq, image_id, false, true,
                      [=](RetrievalState* state) -> std::optional<Candidates> {
                        state->NoteWithdrawn(image_id, submap_id);
                        return std::nullopt;
                      }});
  }
  RunReadySteps();
}

void RetrievalService::OnFailure(const failure_t& failure) {
  if (!failure.parked || failure.image_id == 0) return;
  steps_.push_back({failure.header.seq, failure.image_id, false, true,
                    [id = failure.image_id](RetrievalState* state) -> std::optional<Candidates> {
                      state->NoteFailed(id);
                      return std::nullopt;
                    }});
  RunReadySteps();
}

void RetrievalService::OnBlob(int64_t seq, int64_t image_id, const Result<Bytes>& bytes) {
  auto descriptor =
      bytes ? DecodeGlobalDescriptor(*bytes) : Result<GlobalDescriptor>(bytes.status());
  for (Step& step : steps_) {
    if (step.seq != seq) continue;
    step.ready = true;
    step.apply = [image_id,
                  descriptor](RetrievalState* state) -> Result<std::optional<Candidates>> {
      if (!descriptor.ok()) return descriptor.status();
      Result<Candidates> candidates = state->Add(image_id, *descriptor);
      if (!candidates.ok()) return candidates.status();
      return std::optional<Candidates>(*std::move(candidates));
    };
  }
  RunReadySteps();
}

void RetrievalService::RunReadySteps() {
  while (!steps_.empty() && steps_.front().ready) {
    const Step step = std::move(steps_.front());
    steps_.pop_front();
    worker_->Run(
        [this, state = state_, step] {
          auto candidates = Apply(step, state.get());
          if (candidates) state->unanswered()[candidates->image_id] = *candidates;
          state->set_seq(step.seq);
          return candidates;
        },
        [this, seq = step.seq](std::optional<Candidates> candidates) {
          OnStepDone(seq, std::move(candidates));
        });
  }
}

// Whatever is wrong with its descriptor, whatever throws, and whatever the process died of thrice,
// a photo is answered for: without candidates.
std::optional<Candidates> RetrievalService::Apply(const Step& step, RetrievalState* state) const {
  Result<std::optional<Candidates>> applied = FailedPrecondition("left out: see retrieval.failed");
  if (!failed_.IsLeftOut(step.image_id)) {
    applied =
        AttemptStep(&node_.steps(), 0, {step.image_id, kStep}, [&] { return step.apply(state); });
  }
  if (applied.ok()) return *std::move(applied);
  LogWarn("image {} {}: {}", step.image_id, step.asks ? "has no candidates" : "is not updated",
          applied.error());
  if (!step.asks) return std::nullopt;
  Candidates none;
  none.image_id = step.image_id;
  return none;
}

void RetrievalService::OnStepDone(int64_t seq, std::optional<Candidates> candidates) {
  done_seq_ = seq;
  if (!candidates) return;
  ++num_done_;
  sum_s_ += candidates->insert_s + candidates->query_s;
  const auto [open, is_new] = open_.try_emplace(candidates->image_id, *candidates);
  if (caught_up_ && is_new) Submit(open->second);
}

void RetrievalService::Submit(const Candidates& candidates) {
  node_.submitter().Submit(ToMessage(candidates, done_seq_),
                           [this, id = candidates.image_id](const Submission& done) {
                             if (!done.committed())
                               LogWarn("candidates of image {} refused: {}", id, done.reason);
                             ForgetAnswer(id);
                           });
}

// After a start: what the ledger holds already was struck out while it was read.
void RetrievalService::SubmitWhatIsOpen() {
  for (const auto& [image_id, candidates] : open_) Submit(candidates);
}

void RetrievalService::ForgetAnswer(int64_t image_id) {
  open_.erase(image_id);
  worker_->Run([state = state_, image_id] { state->unanswered().erase(image_id); }, [] {});
}

// Photos wait while it is written, so a large index is written less often.
void RetrievalService::Checkpoint() {
  checkpoint_due_s_ = node_.loop().now_s() + kCheckpointPeriodS;
  if (checkpoint_path_.empty() || done_seq_ == checkpoint_seq_) return;
  checkpoint_seq_ = done_seq_;
  checkpoint_due_s_ = std::numeric_limits<double>::infinity();
  worker_->Run(
      [state = state_, id = node_.session_id(), path = checkpoint_path_] {
        const Timer timer;
        WriteCheckpoint(*state, id, path);
        return timer.ElapsedS();
      },
      [this](double elapsed_s) {
        checkpoint_due_s_ =
            node_.loop().now_s() + std::max(kCheckpointPeriodS, kCheckpointPause * elapsed_s);
      });
}

void RetrievalService::Tick() {
  if (node_.loop().now_s() >= checkpoint_due_s_) Checkpoint();
  if (caught_up_ || !follower_->caught_up()) return;
  if (follower_->head_seq() < start_seq_) {
    LogWarn("checkpoint is at ledger position {}, the ledger ends at {}; rebuilding the index",
            start_seq_, follower_->head_seq());
    return Start(std::make_shared<RetrievalState>(options_));
  }
  // Answers come in after their photos, so wait until the photos read are worked off, too.
  if (!steps_.empty() || worker_->num_pending() > 0) return;
  caught_up_ = true;
  SubmitWhatIsOpen();
}

void RetrievalService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->state = caught_up_ ? "following" : "replaying";
  heartbeat->ledger_seq = follower_->processed_seq();
  heartbeat->backlog = static_cast<int32_t>(steps_.size()) + worker_->num_pending();
  heartbeat->num_done = num_done_;
  heartbeat->mean_s = num_done_ > 0 ? static_cast<float>(sum_s_ / num_done_) : 0;
}

}  // namespace skein
