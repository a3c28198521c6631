#include "ingest/diagnosis_teller.h"

#include <utility>

#include "ledger/facts.h"
#include "session/diagnosis.h"

namespace skein {
namespace {

constexpr double kLookS = 1, kAgainS = 10;
constexpr int kMaxMessages = 50;  // of a look; what is left is told by the next
constexpr int kTimesPlaced = 3;

photo_diagnosis_t ToMessage(const PhotoState& photo, const Diagnosis& diagnosis) {
  photo_diagnosis_t message{};
  message.image_id = photo.image.image_id;
  message.agent = photo.image.agent;
  message.name = photo.image.name;
  message.cause = static_cast<int8_t>(diagnosis.cause);
  message.what = ClampText(diagnosis.what);
  message.remedy = ClampText(diagnosis.remedy);
  message.num_inliers = diagnosis.num_inliers;
  message.best_other_id = diagnosis.best_other_id;
  return message;
}

}  // namespace

DiagnosisTeller::DiagnosisTeller(const SessionState& state, std::string session_id, Publish publish)
    : state_(state), session_id_(std::move(session_id)), publish_(std::move(publish)) {}

void DiagnosisTeller::Tick(double now_s) {
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + kLookS;
  num_left_ = kMaxMessages;
  for (const auto& [id, photo] : state_.photos()) {
    if (num_left_ == 0) return;
    const auto told = told_.find(id);
    if (!state_.IsRegistered(id)) {
      Tell(photo, now_s);
    } else if (told != told_.end()) {
      TellPlaced(photo, &told->second, now_s);
      if (told->second.times_placed == kTimesPlaced) told_.erase(told);
    }
  }
}

void DiagnosisTeller::Tell(const PhotoState& photo, double now_s) {
  const Diagnosis diagnosis = Diagnose(state_, photo);
  if (diagnosis.cause == Diagnosis::Cause::kWaiting) return;
  Told& told = told_[photo.image.image_id];
  const std::string text = diagnosis.Text();
  if (told.text == text && now_s < told.again_s) return;
  told = {text, now_s + kAgainS, 0};
  photo_diagnosis_t message = ToMessage(photo, diagnosis);
  message.session_id = session_id_;
  publish_(message);
  --num_left_;
}

void DiagnosisTeller::TellPlaced(const PhotoState& photo, Told* told, double now_s) {
  if (told->times_placed > 0 && now_s < told->again_s) return;
  ++told->times_placed;
  told->again_s = now_s + kAgainS;
  photo_diagnosis_t message = ToMessage(photo, {});
  message.session_id = session_id_;
  message.cause = photo_diagnosis_t::PLACED;
  publish_(message);
  --num_left_;
}

}  // namespace skein
