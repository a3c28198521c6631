#include "guide/guide_service.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/log.h"
#include "core/process.h"
#include "event_loop/exit_signal.h"
#include "event_loop/step_record.h"
#include "guide/messages.h"
#include "session/read_session.h"

namespace skein {
namespace {

// Of the host's processor time, as a share of one core's.
double ShareOfACore(double work_share) {
  return std::min(1.0, work_share * std::max(1u, std::thread::hardware_concurrency()));
}

constexpr double kAgainS = 5;
constexpr char kStep[] = "guidance";
constexpr size_t kMaxAgents = 64;  // of a submap that are told what to photograph

NoGoAreas NoGoOf(const GuideOptions& options) {
  if (options.no_go.empty()) return {};
  Result<NoGoAreas> areas = ReadNoGo(options.no_go);
  if (!areas.ok()) throw std::invalid_argument(areas.error());
  return std::move(*areas);
}

// By agent, the submap of its newest registered photo, and that photo.
struct Home {
  int64_t image_id = 0;
  int64_t submap_id = 0;
};
std::map<std::string, Home> HomesOf(const SessionState& state) {
  std::map<std::string, Home> homes;
  for (const auto& [submap_id, submap] : state.submaps()) {
    if (submap.ended) continue;
    for (const auto& [image_id, word] : submap.photos) {
      const PhotoState* photo = state.FindPhoto(image_id);
      if (photo == nullptr || !submap.IsRegistered(image_id)) continue;
      Home& home = homes[photo->image.agent];
      if (image_id > home.image_id) home = {image_id, submap_id};
    }
  }
  return homes;
}

// Of those at home there the ones with the newest photos.
std::set<std::string> AgentsAt(const SessionState& state, int64_t submap_id) {
  std::vector<std::pair<int64_t, std::string>> found;
  for (const auto& [agent, home] : HomesOf(state)) {
    if (home.submap_id == submap_id) found.emplace_back(home.image_id, agent);
  }
  std::sort(found.rbegin(), found.rend());
  if (found.size() > kMaxAgents) found.resize(kMaxAgents);
  std::set<std::string> agents;
  for (const auto& [image_id, agent] : found) agents.insert(agent);
  return agents;
}

}  // namespace

GuideService::GuideService(Node& node, const GuideOptions& options)
    : node_(node),
      options_(options),
      no_go_(NoGoOf(options)),
      share_(ShareOfACore(options.work_share)),
      failed_(node.options().session_dir, "guide.failed", kStep, node.steps().left(),
              PreviousExitSignal()) {
  worker_ = std::make_unique<WorkerThread>(node.loop());
  shapes_ = std::make_unique<ShapeFollower>(node, store_, FollowShapes());
  follower_ = std::make_unique<LedgerFollower>(node, 1, [this](const Fact& fact) { OnFact(fact); });
  timer_ = node.loop().AddTimer(kAgainS, [this] { TellAgain(); });
  node.OnHeartbeat([this](heartbeat_t* heartbeat) {
    heartbeat->ledger_seq = follower_->processed_seq();
    heartbeat->backlog = static_cast<int32_t>(changed_.size());
    heartbeat->num_done = num_done_;
    heartbeat->mean_s = num_done_ == 0 ? 0.F : static_cast<float>(sum_s_ / num_done_);
    heartbeat->state = Counted(static_cast<int64_t>(guidance_.size()), "place") + ", advice for " +
                       Counted(static_cast<int64_t>(advice_.size()), "agent");
  });
}

GuideService::~GuideService() { node_.loop().CancelTimer(timer_); }

ShapeFollowerOptions GuideService::FollowShapes() {
  ShapeFollowerOptions options = FollowLiveSubmaps(state_);
  options.on_shape = [this](int64_t submap_id, uint64_t version) {
    LogDebug("submap {}: a shape of {} photos, made {:.3f} s ago", submap_id,
             store_.Find(submap_id)->photos.size(),
             1e-6 * static_cast<double>(NowUs() - static_cast<int64_t>(version)));
    GuideAnew(submap_id);
  };
  return options;
}

void GuideService::OnFact(const Fact& fact) {
  state_.Apply(fact);
  if (const auto* image = std::get_if<image_t>(&fact))
    vain_.NotePhoto(image->agent, image->image_id);
  NoteOutcome(fact);
  const auto* end = std::get_if<submap_end_t>(&fact);
  if (end == nullptr) return;
  store_.Drop(end->submap_id);
  vain_.Drop(end->submap_id);
  guides_.erase(end->submap_id);
  guidance_.erase(end->submap_id);
  for (auto advice = advice_.begin(); advice != advice_.end();) {
    const bool is_of_it = advice->second.submap_id == end->submap_id;
    advice = is_of_it ? advice_.erase(advice) : std::next(advice);
  }
}

// Failed advice is replaced at once: no new shape would come of it.
void GuideService::NoteOutcome(const Fact& fact) {
  int64_t image_id = 0;
  if (const auto* tried = std::get_if<registration_t>(&fact)) image_id = tried->image_id;
  if (const auto* matched = std::get_if<matches_t>(&fact)) image_id = matched->image_id;
  const int64_t submap_id = image_id == 0 ? 0 : vain_.NoteOutcome(state_, image_id);
  if (submap_id != 0) GuideAnew(submap_id);
}

void GuideService::GuideAnew(int64_t submap_id) {
  if (failed_.IsLeftOut(submap_id)) return;
  if (std::find(changed_.begin(), changed_.end(), submap_id) == changed_.end()) {
    changed_.push_back(submap_id);
  }
  StartIfDue();
}

void GuideService::StartIfDue() {
  if (working_ || waiting_ || changed_.empty()) return;
  const double wait_s = share_.due_s() - node_.loop().now_s();
  if (wait_s <= 0) {
    const int64_t submap_id = changed_.front();
    changed_.pop_front();
    return Start(submap_id);
  }
  waiting_ = true;
  node_.loop().AddOneShot(wait_s, alive_.Guarded([this] {
    waiting_ = false;
    StartIfDue();
  }));
}

void GuideService::Start(int64_t submap_id) {
  const ShapePtr shape = store_.Find(submap_id);
  if (shape == nullptr || !state_.IsLive(submap_id)) return StartIfDue();
  LogDebug("submap {}: begins with {} photos", submap_id, shape->photos.size());
  std::shared_ptr<PlaceGuide>& guide = guides_[submap_id];
  if (guide == nullptr) guide = std::make_shared<PlaceGuide>(options_, no_go_);
  worker_->Run(
      [&steps = node_.steps(), guide, submap_id, input = InputOf(shape)] {
        const double begin_s = ThreadCpuS();
        Result<PlaceGuidance> guidance =
            AttemptStep(&steps, 0, {submap_id, kStep}, [&] { return guide->Update(input); });
        return Job{std::move(guidance), ThreadCpuS() - begin_s};
      },
      [this, submap_id, begin_s = node_.loop().now_s()](const Job& job) {
        // Shapes were pulled and read meanwhile, too.
        const double cpu_s = CpuTimeS();
        share_.NoteWork(cpu_s - std::exchange(noted_cpu_s_, cpu_s), begin_s);
        OnDone(submap_id, job);
      });
  working_ = true;
}

PlaceInput GuideService::InputOf(const ShapePtr& shape) const {
  PlaceInput input;
  input.shape = shape;
  for (const ShapePhoto& photo : shape->photos) {
    const PhotoState* known = state_.FindPhoto(photo.image_id);
    if (known == nullptr) continue;
    const image_t& image = known->image;
    input.photos[photo.image_id] = {image.agent, image.name, image.has_gps != 0,
                                    PositionOf(image).value_or(GeodeticPosition()),
                                    TextureOf(*known)};
  }
  input.agents = AgentsAt(state_, shape->submap_id);
  for (const std::string& agent : input.agents) {
    input.in_vain[agent] = vain_.Of(agent, shape->submap_id);
  }
  return input;
}

void GuideService::OnDone(int64_t submap_id, const Job& job) {
  working_ = false;
  ++num_done_;
  sum_s_ += job.seconds;
  Status status = job.guidance.status();
  if (status.ok() && state_.IsLive(submap_id)) {
    status = Attempt([&] { Tell(*job.guidance); });
    LogDebug("submap {}: {} photos, {}; {:.3f} s of CPU", submap_id, job.guidance->place.num_photos,
             job.guidance->place.sentence, job.seconds);
  }
  if (!status.ok()) NoteFailure(submap_id, status);
  StartIfDue();
}

// An exception may leave the submap's guide half done: the next shape begins with another.
void GuideService::NoteFailure(int64_t submap_id, const Status& status) {
  LogWarn("submap {}: no guidance: {}", submap_id, status.error());
  if (status.code != StatusCode::kUnavailable || !state_.IsLive(submap_id)) return;
  guides_.erase(submap_id);
  failed_.Note(submap_id);
}

void GuideService::Tell(const PlaceGuidance& guidance) {
  const int64_t submap_id = guidance.submap_id;
  guidance_t told = ToMessage(guidance);
  told.author = node_.instance();
  node_.Publish(kGuidanceChannel, told);
  guidance_[submap_id] = told;
  for (const AgentAdvice& advice : guidance.advice) {
    vain_.NoteAdvice(submap_id, advice);
    advice_t message = ToMessage(guidance, advice);
    message.author = node_.instance();
    node_.Publish(kAdviceChannel, message);
    advice_[advice.agent] = std::move(message);
  }
}

void GuideService::TellAgain() {
  for (const auto& [submap_id, guidance] : guidance_) node_.Publish(kGuidanceChannel, guidance);
  for (const auto& [agent, advice] : advice_) node_.Publish(kAdviceChannel, advice);
}

}  // namespace skein
