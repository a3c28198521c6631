#include "web/finish_asker.h"

#include <utility>

#include "core/process.h"

namespace skein {
namespace {

constexpr double kAskS = 0.5;
constexpr double kAnswerS = 15;
constexpr size_t kMaxAsked = 16;

}  // namespace

FinishAsker::FinishAsker(Node& node, std::function<bool(int64_t)> has_begun)
    : node_(node), has_begun_(std::move(has_begun)) {
  timer_ = node_.loop().AddTimer(kAskS, [this] { Tick(); });
}

FinishAsker::~FinishAsker() { node_.loop().CancelTimer(timer_); }

void FinishAsker::Ask(double within_s, Done done) {
  if (asked_.size() >= kMaxAsked) return done(Unavailable("ingest is being asked already"));
  asked_[static_cast<int64_t>(RandomU64() >> 1)] = {within_s, node_.loop().now_s(),
                                                    std::move(done)};
  Tick();
}

void FinishAsker::Tick() {
  for (auto asked = asked_.begin(); asked != asked_.end();) {
    const auto& [command_id, what] = *asked;
    const bool has_begun = has_begun_(command_id);
    if (has_begun || node_.loop().now_s() - what.since_s > kAnswerS) {
      what.done(has_begun ? Status::Ok()
                          : Unavailable("ingest does not answer: is it running? Try again"));
      asked = asked_.erase(asked);
      continue;
    }
    command_t command{};
    command.command_id = command_id;
    command.sender = node_.instance();
    command.verb = "finish";
    if (what.within_s > 0) command.argument = std::to_string(what.within_s);
    node_.Publish(kCommandChannel, command);
    ++asked;
  }
}

}  // namespace skein
