#include "ingest/photo_intake.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/attempt.h"
#include "core/hash.h"
#include "core/log.h"
#include "event_loop/step_record.h"
#include "ledger/fact_ids.h"
#include "ledger/photo_file.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr int kDuplicatesARefusal = 10;  // that the ledger keeps
constexpr double kLookAtDiskS = 1;
constexpr int kIntakeSlot = 1;  // the worker's
constexpr char kIntakeStep[] = "photo";
constexpr char kStage[] = "ingest";
constexpr char kCameraNote[] = "camera";
constexpr char kRenamedNote[] = "renamed";
constexpr char kDuplicateNote[] = "duplicate";

// Of the photos that rest, and of what has come of them.
constexpr size_t kMaxResting = 256;
constexpr int64_t kMaxRestingBytes = int64_t{256} << 20;

std::unique_ptr<PhotoDecoder> StartDecoder(const DecoderOptions& options) {
  auto decoder = PhotoDecoder::Start(options);
  if (!decoder.ok()) throw std::runtime_error(decoder.error());
  return *std::move(decoder);
}

// Nothing where it makes no sense: anybody can offer.
std::optional<GpsPosition> OfferedPosition(const image_offer_t& offer) {
  const bool is_place = std::abs(offer.latitude_deg) <= 90 && std::abs(offer.longitude_deg) <= 180;
  if (!offer.has_gps || !is_place) return std::nullopt;
  GpsPosition gps{offer.latitude_deg, offer.longitude_deg, {}, {}};
  if (offer.has_altitude && std::isfinite(offer.altitude_m)) gps.altitude_m = offer.altitude_m;
  return gps;
}

void SetPosition(const std::optional<GpsPosition>& gps, image_t* fact) {
  fact->has_gps = gps.has_value();
  if (!gps) return;
  fact->latitude_deg = gps->latitude_deg;
  fact->longitude_deg = gps->longitude_deg;
  fact->has_altitude = gps->altitude_m.has_value();
  fact->altitude_m = gps->altitude_m.value_or(0);
  fact->has_relative_altitude = gps->relative_altitude_m.has_value();
  fact->relative_altitude_m = gps->relative_altitude_m.value_or(0);
}

PhotoStore::Names NamesIn(const SessionState& state) {
  PhotoStore::Names names;
  for (const auto& [id, photo] : state.photos()) {
    names.insert({photo.image.agent, photo.image.name});
  }
  return names;
}

}  // namespace

PhotoIntake::PhotoIntake(Node& node, LedgerWriter& writer, SessionPaths paths,
                         IntakeOptions options, Clock listened)
    : node_(node),
      writer_(writer),
      paths_(std::move(paths)),
      options_(options),
      listened_(std::move(listened)),
      cameras_(writer.Notes(kCameraNote)),
      renamed_(writer.Notes(kRenamedNote)),
      duplicates_(writer.Notes(kDuplicateNote)),
      kept_refusals_{options_.bounds.max_refusals_agent},
      kept_duplicates_{kDuplicatesARefusal * options_.bounds.max_refusals_agent},
      blobs_(paths_.Blobs()),
      room_(paths_.root, options_.min_free_bytes),
      store_(paths_, options_.limits, NamesIn(writer.state()), StartDecoder(options_.decoder)),
      left_(FindLeftPhotos(paths_, NamesIn(writer.state()))),
      worker_(node.loop()) {
  CountKept();
  if (!left_.empty()) LogInfo("{} photos in images/ that no fact names", left_.size());
}

void PhotoIntake::Kept::Add(const std::string& agent) {
  ++of_agent[agent];
  ++of_all;
}

bool PhotoIntake::Kept::HasRoomFor(const std::string& agent) const {
  const auto found = of_agent.find(agent);
  return of_all < 10 * max_of_agent && (found == of_agent.end() || found->second < max_of_agent);
}

void PhotoIntake::CountKept() {
  for (const auto& [seq, failure] : writer_.history().all_failures()) {
    if (failure.stage == kStage && failure.parked) kept_refusals_.Add(failure.agent);
  }
  for (const auto& [key, agent] : duplicates_) kept_duplicates_.Add(agent);
}

void PhotoIntake::OnOffer(const image_offer_t& offer) {
  const Key key = RefusedOfferFactId(offer.agent, offer.name, offer.blob_id);
  if (AnswerDecided(key, offer)) return;
  const auto pending = pending_.find(key);
  if (pending != pending_.end()) {
    FollowOwner(key, offer);
    return Ack(offer, image_ack_t::WAIT, 0,
               pending->second.rests ? "nothing comes of it; does ingest reach the agent?"
                                     : "being received");
  }
  if (Status status = CheckPullable(offer); !status.ok()) {
    node_.bus().Refuse(kImageOfferChannel.name, status.error().c_str());
    const bool too_large = status.code == StatusCode::kResourceExhausted;
    return Ack(offer, image_ack_t::REFUSED, 0, status.error(),
               too_large ? failure_t::TOO_LARGE : failure_t::OTHER);
  }
  if (writer_.state().finishing()) {
    return Ack(offer, image_ack_t::WAIT, 0, "the session is finishing; offer again");
  }
  if (!HasPlaceFor(offer.agent)) {
    return Ack(offer, image_ack_t::WAIT, 0, "other photos are being received; offer again");
  }
  if (!room_.HasRoomFor(offer.size_bytes)) {
    return Ack(offer, image_ack_t::WAIT, 0, room_.Describe());
  }
  Begin(key, offer);
}

// Answers for what is in the ledger already. Staged facts aren't durable yet: not answered.
bool PhotoIntake::AnswerDecided(const Key& key, const image_offer_t& offer) {
  if (const failure_t* refused = writer_.history().FindFailure(key)) {
    if (refused->header.seq > writer_.durable_head()) return true;
    Ack(offer, image_ack_t::REFUSED, 0, refused->reason, refused->cause);
    return true;
  }
  const int64_t image_id = writer_.history().FindImageByBlob(offer.blob_id);
  if (image_id == 0 || !CheckPullable(offer).ok() || !CheckPhotoName(offer.name).ok()) return false;
  const image_t& image = writer_.state().FindPhoto(image_id)->image;
  if (image.header.seq > writer_.durable_head()) return true;
  if (!blobs_.Has(offer.blob_id)) return false;
  if (IsSamePhoto(key, offer, image)) {
    Ack(offer, image_ack_t::STORED, image_id);
    return true;
  }
  NoteDuplicate(key, offer.agent);
  Ack(offer, image_ack_t::DUPLICATE, image_id, "same content as " + image.agent + "/" + image.name);
  return true;
}

bool PhotoIntake::IsSamePhoto(const Key& key, const image_offer_t& offer,
                              const image_t& image) const {
  return (image.agent == offer.agent && image.name == offer.name) || renamed_.count(key) > 0;
}

void PhotoIntake::NoteDuplicate(const Key& key, const std::string& agent) {
  if (duplicates_.count(key) > 0 || !kept_duplicates_.HasRoomFor(agent)) return;
  kept_duplicates_.Add(agent);
  duplicates_[key] = agent;
  writer_.StageNote({kDuplicateNote, key, agent});
}

Status PhotoIntake::CheckPullable(const image_offer_t& offer) const {
  if (Status status = CheckAgentName(offer.agent); !status.ok()) return status;
  if (!IsBlobId(offer.blob_id)) return InvalidArgument("hash is not 64 lower-case hex digits");
  if (offer.size_bytes < 0) return InvalidArgument("a negative size");
  if (offer.size_bytes > options_.limits.max_bytes) {
    return ResourceExhausted("file has " + std::to_string(offer.size_bytes) + " bytes, more than " +
                             std::to_string(options_.limits.max_bytes));
  }
  return Status::Ok();
}

bool PhotoIntake::HasPlaceFor(const std::string& agent) const {
  int num_active = 0, num_of_agent = 0;
  for (const auto& [key, pending] : pending_) {
    if (pending.rests) continue;
    ++num_active;
    num_of_agent += pending.offer.agent == agent;
  }
  return num_active < options_.max_pending && num_of_agent < options_.max_pending_agent;
}

void PhotoIntake::Begin(const Key& key, const image_offer_t& offer) {
  Pending& pending = pending_[key];
  pending.offer = offer;
  pending.is_signed = node_.bus().IsSigned();
  pending.received_utime_us = writer_.now_us();
  pending.progress_s = listened_();
  Pull(key, &pending);
  Ack(offer, image_ack_t::WAIT, 0, "being received");
}

void PhotoIntake::Pull(const Key& key, Pending* pending) {
  BlobClient::FetchOptions options;
  options.max_bytes = options.size_bytes = pending->offer.size_bytes;
  options.takes_unsigned = !pending->is_signed;
  options.party = AgentInstance(pending->offer.agent);
  pending->fetch_id = node_.blobs().Fetch(
      pending->offer.blob_id, pending->offer.owner,
      [this, key](Result<Bytes> bytes) { OnBytes(key, std::move(bytes)); }, options);
}

// The agent came back under another name, or another process offers the same. An offer without a
// signature does not take the place of a signed one.
void PhotoIntake::FollowOwner(const Key& key, const image_offer_t& offer) {
  Pending& pending = pending_.at(key);
  const bool is_signed = node_.bus().IsSigned();
  const bool is_same = pending.offer.owner == offer.owner && pending.is_signed == is_signed;
  if (pending.fetch_id == 0 || is_same || (pending.is_signed && !is_signed)) return;
  node_.blobs().Cancel(pending.fetch_id);
  pending.offer.owner = offer.owner;
  pending.is_signed = is_signed;
  Pull(key, &pending);
}

void PhotoIntake::OnBytes(const Key& key, Result<Bytes> bytes) {
  const auto found = pending_.find(key);
  if (found == pending_.end()) return;
  Pending& pending = found->second;
  // Also what another agent sent ends a pull: the photo is that agent's.
  if (HasCome(pending.offer.blob_id)) {
    pending_.erase(found);
    return;
  }
  pending.fetch_id = 0;
  pending.progress_s = listened_();
  pending.rests = false;
  // The owner has no such blob any more, or anybody's chunks were not the blob's.
  if (!bytes.ok()) return Abandon(key, bytes.error());
  const auto size = static_cast<int64_t>(bytes->size());
  if (size != pending.offer.size_bytes) {
    return Abandon(key, "size does not match: offered " + std::to_string(pending.offer.size_bytes) +
                            " bytes, the photo has " + std::to_string(size));
  }
  if (Status status = CheckPhotoName(pending.offer.name); !status.ok()) {
    return Refuse(key, pending.offer, PhotoFault::kOther, status.error());
  }
  const int64_t image_id = writer_.history().FindImageByBlob(pending.offer.blob_id);
  if (image_id == 0) return Store(key, *std::move(bytes));
  const image_t& image = writer_.state().FindPhoto(image_id)->image;
  if (!blobs_.Has(image.blob_id)) return Restore(key, image, *std::move(bytes));
  pending_.erase(found);  // another offer was faster
}

// Of an offer that is being decided.
bool PhotoIntake::HasCome(const std::string& blob_id) const {
  return std::any_of(pending_.begin(), pending_.end(), [&](const auto& entry) {
    return entry.second.fetch_id == 0 && entry.second.offer.blob_id == blob_id;
  });
}

// As WorkerThread::Run, when it is the agent's turn. `then` takes the job's AttemptResult.
template <class Job, class Then>
void PhotoIntake::RunInTurn(const std::string& agent, Job job, Then then) {
  jobs_.Add(agent, [this, agent, job = std::move(job), then = std::move(then)]() mutable {
    const double begin_s = node_.loop().now_s();
    auto attempt = [&steps = node_.steps(), job = std::move(job)] {
      return AttemptStep(&steps, kIntakeSlot, {0, kIntakeStep}, job);
    };
    worker_.Run(std::move(attempt), [this, agent, begin_s, then](auto result) {
      jobs_.NoteWork(agent, node_.loop().now_s() - begin_s);
      then(std::move(result));
      RunNext();
    });
  });
  RunNext();
}

void PhotoIntake::RunNext() {
  if (worker_.num_pending() > 0) return;
  if (auto next = jobs_.Take()) next->job();
}

void PhotoIntake::Store(const Key& key, Bytes bytes) {
  const image_offer_t& offer = pending_.at(key).offer;
  RunInTurn(
      offer.agent,
      [this, agent = offer.agent, name = offer.name, blob_id = offer.blob_id,
       content = std::move(bytes)] { return store_.Take(agent, name, blob_id, content); },
      [this, key](const Result<TakenPhoto>& taken) { OnTaken(key, taken); });
}

// The agent's next offer is answered from the ledger.
void PhotoIntake::Restore(const Key& key, const image_t& image, Bytes bytes) {
  RunInTurn(
      pending_.at(key).offer.agent,
      [paths = paths_, agent = image.agent, name = image.name, content = std::move(bytes)] {
        return StorePhoto(paths, agent, name, content);
      },
      [this, key, image](const Status& stored) {
        if (!stored.ok()) return Abandon(key, stored.error());
        LogInfo("photo {} is there again", PhotoName(image.agent, image.name));
        pending_.erase(key);
      });
}

// One after the other, as a finish must not run.
void PhotoIntake::TakeInLeft() {
  if (left_.empty() || writer_.state().finishing() || !HasPlaceFor(left_.back().agent)) return;
  const LeftFile file = left_.back();
  left_.pop_back();
  RunInTurn(
      file.agent, [paths = paths_, file] { return ReadLeftPhoto(paths, file); },
      [this](const Result<LeftPhoto>& photo) {
        if (photo.ok()) return OnLeft(*photo);
        LogWarn("a photo in images/ is left there: {}", photo.error());
      });
}

// The second file of a content that is known stays where it is.
void PhotoIntake::OnLeft(const LeftPhoto& photo) {
  TakeInLeft();
  image_offer_t offer{};
  offer.agent = photo.file.agent;
  offer.name = photo.file.name;
  offer.blob_id = photo.blob_id;
  offer.size_bytes = static_cast<int64_t>(photo.bytes.size());
  const Key key = RefusedOfferFactId(offer.agent, offer.name, offer.blob_id);
  const bool known = writer_.history().FindImageByBlob(offer.blob_id) != 0 ||
                     writer_.history().FindFailure(key) != nullptr || pending_.count(key) > 0;
  if (known || !CheckPullable(offer).ok()) return;
  Pending& pending = pending_[key];
  pending.offer = offer;
  pending.received_utime_us = writer_.now_us();
  Store(key, photo.bytes);
}

void PhotoIntake::OnTaken(const Key& key, const Result<TakenPhoto>& taken) {
  Status status = taken.status();
  if (status.ok()) status = Attempt([&] { Decide(key, *taken); });
  if (!status.ok()) NoteThrown(key, status.error());
}

void PhotoIntake::NoteThrown(const Key& key, const std::string& reason) {
  const auto pending = pending_.find(key);
  if (pending == pending_.end()) return LogError("{}", reason);
  if (!thrown_.Note(key)) return Abandon(key, reason);
  Refuse(key, pending->second.offer, PhotoFault::kOther, reason);
}

void PhotoIntake::Decide(const Key& key, const TakenPhoto& taken) {
  switch (taken.outcome) {
    case TakenPhoto::Outcome::kRefused:
      return Refuse(key, pending_.at(key).offer, taken.fault, taken.reason);
    case TakenPhoto::Outcome::kFailed:
      return Abandon(key, taken.reason);
    case TakenPhoto::Outcome::kStored:
      Commit(key, taken.photo, taken.name);
      break;
    case TakenPhoto::Outcome::kKnown:  // the agent's next offer is answered as a duplicate
      break;
  }
  pending_.erase(key);
}

void PhotoIntake::Commit(const Key& key, const CheckedPhoto& photo, const std::string& name) {
  const Pending& pending = pending_.at(key);
  const image_offer_t offer = pending.offer;
  const KnownCamera* known = FindKnownCamera(options_.cameras, offer.agent, photo);
  const FocalPrior focal =
      known != nullptr ? FocalPrior{known->FocalPx(), true} : ChooseFocal(photo, offer.focal_px);
  std::string camera_key = CameraKey(offer.agent, photo, focal);
  if (known != nullptr) camera_key += "|" + known->Text();
  const auto [camera, is_new] =
      cameras_.emplace(camera_key, std::to_string(writer_.state().num_cameras() + 1));
  std::vector<LedgerNote> notes;
  if (is_new) notes.push_back({kCameraNote, camera_key, camera->second});
  const std::string image_id = std::to_string(writer_.state().next_image_id());
  if (name != offer.name) {
    renamed_[key] = image_id;
    notes.push_back({kRenamedNote, key, image_id});
  }
  writer_.Stage(MakeFact(pending, photo, name, focal, std::stoll(camera->second), known), notes,
                [this, offer](const Fact& fact) {
                  Ack(offer, image_ack_t::STORED, std::get<image_t>(fact).image_id);
                });
}

image_t PhotoIntake::MakeFact(const Pending& pending, const CheckedPhoto& photo,
                              const std::string& name, const FocalPrior& focal, int64_t camera_id,
                              const KnownCamera* known) const {
  const image_offer_t& offer = pending.offer;
  image_t fact{};
  fact.header.fact_id = ImageFactId(offer.blob_id);
  fact.header.author = node_.instance();
  fact.camera_id = camera_id;
  fact.agent = offer.agent;
  fact.name = name;
  fact.width_px = static_cast<int32_t>(photo.header.width_px);
  fact.height_px = static_cast<int32_t>(photo.header.height_px);
  fact.orientation = static_cast<int8_t>(photo.exif.orientation);
  fact.focal_px = focal.focal_px;
  fact.focal_from_exif = focal.from_exif;
  if (known != nullptr) {
    fact.camera_model = known->camera_model;
    fact.num_camera_params = static_cast<int32_t>(known->params.size());
    fact.camera_params = known->params;
    fact.camera_fixed = !known->refine;
  }
  SetPosition(photo.exif.gps ? photo.exif.gps : OfferedPosition(offer), &fact);
  fact.capture_utime_us =
      photo.exif.capture_utime_us != 0 ? photo.exif.capture_utime_us : offer.capture_utime_us;
  fact.received_utime_us = pending.received_utime_us;
  fact.blob_id = offer.blob_id;
  fact.size_bytes = offer.size_bytes;
  return fact;
}

// By value: the pending photo that the offer may belong to ends here.
void PhotoIntake::Refuse(const Key& key, image_offer_t offer, PhotoFault fault,
                         const std::string& reason) {
  const auto cause = static_cast<int8_t>(fault);
  pending_.erase(key);
  LogWarn("refused {}/{}: {}", Printable(offer.agent), Printable(offer.name), reason);
  if (!kept_refusals_.HasRoomFor(offer.agent)) {
    ++num_not_kept_;
    return Ack(offer, image_ack_t::REFUSED, 0, reason, cause);
  }
  kept_refusals_.Add(offer.agent);
  failure_t failure{};
  failure.header.fact_id = key;
  failure.header.author = node_.instance();
  failure.agent = offer.agent;
  failure.name = Printable(offer.name);
  failure.stage = kStage;
  failure.cause = cause;
  failure.reason = ClampText(reason);
  failure.attempts = 1;
  failure.parked = true;
  writer_.Stage(failure, {}, [this, offer](const Fact& fact) {
    const auto& refused = std::get<failure_t>(fact);
    Ack(offer, image_ack_t::REFUSED, 0, refused.reason, refused.cause);
  });
}

// Not the photo's fault: a later offer of it starts again.
void PhotoIntake::Abandon(const Key& key, const std::string& reason) {
  const image_offer_t offer = pending_.at(key).offer;
  pending_.erase(key);
  LogError("{}/{} must be offered again: {}", offer.agent, Printable(offer.name), reason);
  Ack(offer, image_ack_t::WAIT, 0, reason);
}

void PhotoIntake::Tick() {
  const double now_s = listened_();
  if (now_s - looked_s_ >= kLookAtDiskS) {
    room_.Look();
    looked_s_ = now_s;
  }
  TakeInLeft();
  NoteProgress();
  ForgetWhatRestsLongest();
  if (!writer_.state().finishing()) return;
  std::vector<Key> vanished;
  for (const auto& [key, pending] : pending_) {
    const bool moves = now_s - pending.progress_s <= options_.bounds.vanished_after_s;
    if (pending.fetch_id != 0 && !moves) vanished.push_back(key);
  }
  for (const Key& key : vanished) GiveUp(key);
}

void PhotoIntake::NoteProgress() {
  const double now_s = listened_();
  for (auto& [key, pending] : pending_) {
    if (pending.fetch_id == 0) continue;
    const int64_t received = node_.blobs().ReceivedBytes(pending.fetch_id);
    // What waits for its turn is not held up by its agent.
    const bool waits_for_agent = node_.blobs().IsLate(pending.fetch_id);
    if (received != pending.received_bytes || !waits_for_agent) pending.progress_s = now_s;
    pending.received_bytes = received;
    pending.rests = now_s - pending.progress_s > options_.bounds.rests_after_s;
  }
}

// Their agents offer them again when they are back.
void PhotoIntake::ForgetWhatRestsLongest() {
  std::vector<std::pair<double, Key>> resting;  // latest progress, key
  int64_t num_bytes = 0;
  for (const auto& [key, pending] : pending_) {
    if (!pending.rests) continue;
    resting.emplace_back(pending.progress_s, key);
    num_bytes += pending.received_bytes;
  }
  std::sort(resting.begin(), resting.end());
  size_t num_left = resting.size();
  for (const auto& [progress_s, key] : resting) {
    if (num_left <= kMaxResting && num_bytes <= kMaxRestingBytes) return;
    const auto pending = pending_.find(key);
    node_.blobs().Cancel(pending->second.fetch_id);
    num_bytes -= pending->second.received_bytes;
    --num_left;
    ++num_forgotten_;
    pending_.erase(pending);
  }
}

void PhotoIntake::GiveUp(const Key& key) {
  const Pending pending = pending_.at(key);
  node_.blobs().Cancel(pending.fetch_id);
  pending_.erase(key);
  failure_t failure{};
  failure.header.fact_id =
      VanishedAgentFactId(pending.offer.blob_id, writer_.state().finish().finish_id);
  if (writer_.history().FindFact(failure.header.fact_id) != 0) return;
  failure.header.author = node_.instance();
  failure.agent = pending.offer.agent;
  failure.name = Printable(pending.offer.name);
  failure.stage = kStage;
  failure.cause = failure_t::VANISHED;
  failure.reason = "agent vanished while sending (" + std::to_string(pending.received_bytes) +
                   " of " + std::to_string(pending.offer.size_bytes) + " bytes came)";
  failure.attempts = 1;
  writer_.Stage(failure);
}

std::string PhotoIntake::Describe() const {
  std::string text;
  for (const auto& [key, pending] : pending_) {
    if (!pending.rests) continue;
    text = "; nothing from " + pending.offer.agent + " for " +
           std::to_string(static_cast<int>(listened_() - pending.progress_s)) + " s (" +
           Printable(pending.offer.name) + ")";
    break;
  }
  if (num_forgotten_ > 0 && !pending_.empty())
    text += "; forgotten until offered again: " + std::to_string(num_forgotten_);
  if (!pending_.empty()) text = "receiving " + std::to_string(pending_.size()) + text;
  if (num_not_kept_ > 0) {
    text += (text.empty() ? "" : "; ") + std::to_string(num_not_kept_) +
            " refused photos are not in the report: too many";
  }
  const std::string room = room_.Describe();
  return room + (room.empty() || text.empty() ? "" : "; ") + text;
}

void PhotoIntake::Ack(const image_offer_t& offer, int8_t status, int64_t image_id,
                      const std::string& reason, int8_t cause) {
  image_ack_t ack{};
  ack.agent = offer.agent;
  ack.name = offer.name;
  ack.blob_id = offer.blob_id;
  ack.status = status;
  ack.image_id = image_id;
  ack.cause = cause;
  ack.reason = ClampText(reason);
  node_.Publish(kImageAckChannel, ack);
}

}  // namespace skein
