// role_matrix table|names|attacks relay|receiver require|warn URL SESSION LINK...
//
// Says in each role what it may and what it may not say, and tells what was heard. SESSION is the
// session's folder; each LINK is an invitation. Ingest, the web server and who signs nothing come
// beside them.
//
//   table    each role speaks in its own name on each channel; prints channel by role
//   names    the same in another's name
//   attacks  messages again, late, altered, of other roots, expired, revoked; a table of them.
//   Fails
//            where one was heard that must not be, or the other way round.
//
// relay: who listens takes all that comes, so the relay alone refuses. receiver: who listens is a
// Bus of the session, which refuses by itself; nobody else may speak on that URL then.
//
// The last line is "sent N, heard N, refused N". Exit codes: 0, 1 for a failure, 2 for bad usage.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "core/clock.h"
#include "core/log.h"
#include "ledger/facts.h"
#include "ledger/session_folder.h"
#include "transport/bus.h"
#include "transport/invitation.h"

namespace skein {
namespace {

constexpr double kDeadlineS = 60;
constexpr std::ptrdiff_t kAtOnce = 64;  // messages between two markers: datagrams have no queue
constexpr char kChunkChannel[] = "SKEIN_BLOB_CHUNK_NOBODY";

template <class T>
T Need(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error());
  return *std::move(result);
}

template <class T>
Bytes Encode(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

Bytes WithoutTrailer(const Bytes& message) {
  const auto size = static_cast<std::ptrdiff_t>(SizeWithoutTrailer(message));
  return {message.begin(), message.begin() + size};
}

// In whose name a message is.
struct Name {
  std::string name;      // of the agent
  std::string instance;  // of the process
};

template <class T>
void SpeakAs([[maybe_unused]] const Name& as, [[maybe_unused]] T* message) {
  if constexpr (decode_internal::HasHeader<T>::value) message->header.author = as.instance;
}
void SpeakAs(const Name& as, image_offer_t* offer) {
  offer->agent = as.name;
  offer->owner = as.instance;
}
void SpeakAs(const Name& as, work_request_t* request) { request->worker = as.instance; }
void SpeakAs(const Name& as, work_failed_t* failed) { failed->worker = as.instance; }
void SpeakAs(const Name& as, demand_t* demand) { demand->author = as.instance; }
void SpeakAs(const Name& as, submap_status_t* status) { status->owner = as.instance; }
void SpeakAs(const Name& as, submap_shape_t* shape) { shape->owner = as.instance; }
void SpeakAs(const Name& as, shape_wanted_t* wanted) { wanted->author = as.instance; }
void SpeakAs(const Name& as, guidance_t* guidance) { guidance->author = as.instance; }
void SpeakAs(const Name& as, advice_t* advice) { advice->author = as.instance; }
void SpeakAs(const Name& as, shared_reply_t* reply) { reply->owner = as.instance; }
void SpeakAs(const Name& as, heartbeat_t* heartbeat) { heartbeat->instance = as.instance; }
void SpeakAs(const Name& as, command_t* command) { command->sender = as.instance; }
void SpeakAs(const Name& as, ledger_request_t* request) { request->requester = as.instance; }
void SpeakAs(const Name& as, blob_request_t* request) {
  request->reply_channel = BlobChunkChannel(as.instance);
}

template <class Fn>
void ForEachMainChannel(Fn fn) {
  ForEachCommittedChannel(fn);
  ForEachSubmitChannel(fn);
  fn(kSubmitReplyChannel);
  fn(kImageOfferChannel);
  fn(kImageAckChannel);
  fn(kPhotoDiagnosisChannel);
  fn(kLedgerHeadChannel);
  fn(kLedgerRequestChannel);
  fn(kLedgerRangeChannel);
  fn(kWorkRequestChannel);
  fn(kWorkChannel);
  fn(kWorkFailedChannel);
  fn(kDemandChannel);
  fn(kSubmapStatusChannel);
  fn(kSubmapShapeChannel);
  fn(kShapeWantedChannel);
  fn(kGuidanceChannel);
  fn(kAdviceChannel);
  fn(kSharedRequestChannel);
  fn(kSharedReplyChannel);
  fn(kHeartbeatChannel);
  fn(kCommandChannel);
  fn(kCommandReplyChannel);
  fn(kBlobRequestChannel);
  fn(Channel<heartbeat_t>{"SKEIN_NO_SUCH_CHANNEL"});
}

// A channel of the table.
struct Row {
  std::string label;
  std::string channel;
  bool bulk = false;
  std::function<Bytes(const std::string& session_id, const Name& as)> message;
};

template <class T>
Row RowOf(const Channel<T>& channel) {
  return {channel.name, channel.name, false, [](const std::string& session_id, const Name& as) {
            T message{};
            SessionOf(message) = session_id;
            SpeakAs(as, &message);
            return Encode(message);
          }};
}

std::vector<Row> AllRows() {
  std::vector<Row> rows;
  ForEachMainChannel([&](const auto& channel) { rows.push_back(RowOf(channel)); });
  rows.back().label = "other";
  rows.push_back(RowOf(Channel<blob_chunk_t>{kChunkChannel}));
  rows.back().label = "SKEIN_BLOB_CHUNK_<INSTANCE>";
  rows.back().bulk = true;
  return rows;
}

// A message on its way, with its trailer.
struct Sent {
  bool bulk = false;
  std::string channel;
  Bytes bytes;
};

// Who listens: what it has heard since Forget.
class Ear {
 public:
  virtual ~Ear() = default;
  virtual bool HasHeard(const Sent& sent) const = 0;
  virtual void Forget() = 0;
};

// Takes everything, as it came.
class RawEar : public Ear {
 public:
  RawEar(PollLoop& loop, const LcmUrl& url)
      : main_(Listen(loop, url, false)), bulk_(Listen(loop, url.Bulk(), true)) {
    ForEachMainChannel([&](const auto& channel) { main_->Subscribe(channel.name); });
    bulk_->Subscribe(kChunkChannel);
    bulk_->Subscribe(kHeartbeatChannel.name);
  }
  bool HasHeard(const Sent& sent) const override {
    return heard_.count({sent.bulk, sent.channel, sent.bytes}) > 0;
  }
  void Forget() override { heard_.clear(); }

 private:
  std::unique_ptr<Link> Listen(PollLoop& loop, const LcmUrl& url, bool bulk) {
    return MakeLink(url, loop, [this, bulk](const std::string& channel, const Bytes& message) {
      heard_.emplace(bulk, channel, message);
    });
  }

  std::set<std::tuple<bool, std::string, Bytes>> heard_;
  const std::unique_ptr<Link> main_, bulk_;
};

// As every process of the session. It hears messages without their trailers.
class ReceiverEar : public Ear {
 public:
  ReceiverEar(PollLoop& loop, const LcmUrl& url, const SessionAccess& access,
              const std::string& keys_dir, bool takes_unsigned)
      : bus_(url.ToString(), loop) {
    bus_.SetSession(access.trust.session_id);
    MessageSeal seal(access.trust, access.credential, access.used, NowUs);
    seal.SetRevoked(Revocations(keys_dir));
    bus_.SetSeal(std::make_unique<MessageSeal>(std::move(seal)), takes_unsigned);
    ForEachMainChannel([&](const auto& channel) {
      bus_.Subscribe(channel, [this, name = channel.name](const auto& message) {
        heard_.emplace(false, name, Encode(message));
      });
    });
    SubscribeBulk(Channel<blob_chunk_t>{kChunkChannel});
    SubscribeBulk(kHeartbeatChannel);
  }
  bool HasHeard(const Sent& sent) const override {
    return heard_.count({sent.bulk, sent.channel, WithoutTrailer(sent.bytes)}) > 0;
  }
  void Forget() override { heard_.clear(); }
  // What it has not taken.
  int64_t num_refused() const {
    return bus_.counters().num_refused + bus_.counters().num_other_sessions;
  }

 private:
  template <class T>
  void SubscribeBulk(const Channel<T>& channel) {
    bus_.SubscribeBulk<T>(channel.name, [this, name = std::string(channel.name)](const T& message) {
      heard_.emplace(true, name, Encode(message));
    });
  }

  Bus bus_;
  std::set<std::tuple<bool, std::string, Bytes>> heard_;
};

// A connection to each network.
class Mouth {
 public:
  Mouth(PollLoop& loop, const LcmUrl& url)
      : main_(MakeLink(url, loop, Ignore)), bulk_(MakeLink(url.Bulk(), loop, Ignore)) {}
  bool Say(const Sent& message) {
    Link& link = message.bulk ? *bulk_ : *main_;
    return link.Publish(message.channel, message.bytes.data(), message.bytes.size());
  }

 private:
  static void Ignore(const std::string&, const Bytes&) {}

  const std::unique_ptr<Link> main_, bulk_;
};

// Says messages over a connection, and tells which of them were heard. Behind them goes a marker
// that everybody takes: a connection keeps its messages' order, so what was not heard before the
// marker is never heard.
class Trial {
 public:
  Trial(PollLoop& loop, const LcmUrl& url, Ear* ear, const SessionAccess& marker)
      : loop_(loop),
        url_(url),
        ear_(ear),
        session_id_(marker.trust.session_id),
        marker_name_(marker.credential.certificate.name),
        marker_seal_(marker.trust, marker.credential, marker.used, NowUs) {}

  // A connection that is heard.
  std::unique_ptr<Mouth> Connect() {
    auto mouth = std::make_unique<Mouth>(loop_, url_);
    for (const bool bulk : {false, true}) {
      std::vector<Sent> markers;
      const auto timer = loop_.AddTimer(0.05, [&] {
        markers.push_back(MakeMarker(bulk));
        mouth->Say(markers.back());
      });
      Await([&] {
        return std::any_of(markers.begin(), markers.end(),
                           [&](const Sent& marker) { return ear_->HasHeard(marker); });
      });
      loop_.CancelTimer(timer);
    }
    return mouth;
  }

  // Of each message, whether it was heard.
  std::vector<bool> Say(Mouth* mouth, const std::vector<Sent>& messages) {
    std::vector<bool> heard;
    for (auto next = messages.begin(); next != messages.end();) {
      ear_->Forget();
      const auto end = next + std::min<std::ptrdiff_t>(kAtOnce, messages.end() - next);
      std::for_each(next, end, [&](const Sent& message) { Publish(mouth, message); });
      for (const bool bulk : {false, true}) AwaitMarker(mouth, bulk);
      for (; next != end; ++next) heard.push_back(ear_->HasHeard(*next));
    }
    num_sent_ += static_cast<int64_t>(heard.size());
    num_heard_ += std::count(heard.begin(), heard.end(), true);
    return heard;
  }

  PollLoop& loop() { return loop_; }
  const std::string& session_id() const { return session_id_; }
  int64_t num_sent() const { return num_sent_; }
  int64_t num_heard() const { return num_heard_; }

 private:
  Sent MakeMarker(bool bulk) {
    heartbeat_t marker{};
    marker.session_id = session_id_;
    marker.instance = marker_name_;
    marker.state = "marker " + std::to_string(++num_markers_);
    return {bulk, kHeartbeatChannel.name,
            marker_seal_.Seal(kHeartbeatChannel.name, Encode(marker))};
  }
  void AwaitMarker(Mouth* mouth, bool bulk) {
    const Sent marker = MakeMarker(bulk);
    Publish(mouth, marker);
    Await([&] { return ear_->HasHeard(marker); });
  }
  void Await(const std::function<bool()>& done) {
    if (loop_.RunUntil(done, kDeadlineS)) return;
    throw std::runtime_error("a marker that everybody takes was not heard within the deadline");
  }
  static void Publish(Mouth* mouth, const Sent& message) {
    if (!mouth->Say(message)) throw std::runtime_error(message.channel + ": it cannot be sent");
  }

  PollLoop& loop_;
  const LcmUrl url_;
  Ear* const ear_;
  const std::string session_id_;
  const std::string marker_name_;
  MessageSeal marker_seal_;
  int64_t num_markers_ = 0, num_sent_ = 0, num_heard_ = 0;
};

MessageSeal SealOf(const SessionAccess& access) {
  return {access.trust, access.credential, access.used, NowUs};
}

// A column of the table.
struct Speaking {
  std::string role;
  Name name;
  std::optional<MessageSeal> seal;  // none: it signs nothing
};

Speaking SpeakingAs(const SessionAccess& access) {
  const Certificate& certificate = access.credential.certificate;
  const bool is_agent = certificate.role == Role::kAgent;
  return {RoleName(certificate.role),
          {certificate.name, is_agent ? AgentInstance(certificate.name) : certificate.name},
          SealOf(access)};
}

// Each role on each channel; `as`: in that name, else in its own.
void PrintTable(Trial* trial, std::vector<Speaking> roles, const std::optional<Name>& as) {
  const std::vector<Row> rows = AllRows();
  std::vector<std::string> lines = {"channel"};
  for (const Row& row : rows) lines.push_back(row.label);
  for (Speaking& role : roles) {
    std::vector<Sent> messages;
    for (const Row& row : rows) {
      const Bytes message = row.message(trial->session_id(), as.value_or(role.name));
      messages.push_back(
          {row.bulk, row.channel, role.seal ? role.seal->Seal(row.channel, message) : message});
    }
    const auto mouth = trial->Connect();
    const std::vector<bool> heard = trial->Say(mouth.get(), messages);
    lines.front() += "\t" + role.role;
    for (size_t i = 0; i < rows.size(); ++i) lines[i + 1] += heard[i] ? "\tyes" : "\tno";
  }
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
}

// What a hostile peer can do with messages and certificates of others and of its own. All of it is
// said as a worker's advice, which a worker may give.
class Attacks {
 public:
  Attacks(Trial* trial, const Session& session, const SessionTrust& trust)
      : trial_(trial),
        session_(session),
        trust_(trust),
        mouth_(trial->Connect()),
        worker_(Invite("steady")),
        seal_(SealOf(worker_)) {}

  // Whether all went as it must.
  bool Run() {
    Repeat();
    Alter();
    ComeLate();
    ForgeCertificates();
    ComeFromElsewhere();
    Expire();
    Revoke();
    return is_right_;
  }

 private:
  SessionAccess Invite(const std::string& name, int64_t expires_s = 0,
                       Role role = Role::kWorker) const {
    return Need(
        IssueInvitation(session_.paths.Keys().string(), trust_.session_id, role, name, expires_s));
  }
  SessionAccess With(const SigningKey& key, const Certificate& certificate) const {
    return {trust_, {key, certificate}, {}};
  }

  // A message as no other is.
  Sent Advice(MessageSeal* seal, const std::string& name) {
    advice_t advice{};
    advice.session_id = trust_.session_id;
    advice.author = name;
    advice.submap_id = ++num_made_;
    return {false, kAdviceChannel.name, seal->Seal(kAdviceChannel.name, Encode(advice))};
  }
  Sent Advice() { return Advice(&seal_, worker_.credential.certificate.name); }
  std::vector<Sent> Advices(int count) {
    std::vector<Sent> messages;
    for (int i = 0; i < count; ++i) messages.push_back(Advice());
    return messages;
  }
  Sent AdviceOf(const SessionAccess& access) {
    MessageSeal seal = SealOf(access);
    return Advice(&seal, access.credential.certificate.name);
  }

  void Expect(bool heard, const char* what, const std::vector<Sent>& messages) {
    ExpectOver(mouth_.get(), heard, what, messages);
  }
  void ExpectOver(Mouth* mouth, bool heard, const char* what, const std::vector<Sent>& messages) {
    const std::vector<bool> got = trial_->Say(mouth, messages);
    const auto count = std::count(got.begin(), got.end(), true);
    const bool is_right = count == (heard ? static_cast<std::ptrdiff_t>(messages.size()) : 0);
    is_right_ = is_right_ && is_right;
    std::printf("%s\t%zu\t%td%s\n", what, messages.size(), count, is_right ? "" : "\tWRONG");
  }

  void Repeat() {
    const Sent message = Advice();
    Expect(true, "signed by a worker", {message});
    Expect(false, "the same again", {message});
    const auto stranger = trial_->Connect();
    ExpectOver(stranger.get(), false, "the same again, by another connection", {message});
  }

  void Alter() {
    const Sent message = Advice();
    std::vector<Sent> altered(message.bytes.size(), message);
    for (size_t i = 0; i < altered.size(); ++i) {
      altered[i].bytes[i] ^= static_cast<uint8_t>(1u << (i % 8));
    }
    const auto trailer =
        altered.begin() + static_cast<std::ptrdiff_t>(SizeWithoutTrailer(message.bytes));
    Expect(false, "one bit of the message altered", {altered.begin(), trailer});
    Expect(false, "one bit of the trailer altered", {trailer, altered.end()});
    Expect(false, "its trailer taken away",
           {{false, message.channel, WithoutTrailer(message.bytes)}});
    Expect(false, "on another channel than it was signed for",
           {{false, kGuidanceChannel.name, message.bytes}});
    Expect(true, "the message itself after these", {message});
  }

  void ComeLate() {
    constexpr int kWindow = static_cast<int>(ReplayWindow::kSize);
    const Sent late = Advice();
    Expect(true, "newer ones, fewer than the window", Advices(kWindow - 1));
    Expect(true, "an older one behind them", {late});
    const Sent too_late = Advice();
    Expect(true, "newer ones, two windows", Advices(2 * kWindow));
    Expect(false, "an older one behind them", {too_late});
  }

  void ForgeCertificates() {
    const Credential& own = worker_.credential;
    Certificate renamed = own.certificate;
    renamed.name = "guide";
    Expect(false, "another name in the own certificate", {AdviceOf(With(own.key, renamed))});
    const Credential viewer = Invite("curious", 0, Role::kViewer).credential;
    Certificate raised = viewer.certificate;
    raised.role = Role::kWorker;
    Expect(false, "a higher role in the own certificate", {AdviceOf(With(viewer.key, raised))});
    Expect(false, "another's certificate, signed by an own key",
           {AdviceOf(With(SigningKey::Generate(), own.certificate))});
  }

  void ComeFromElsewhere() {
    const SigningKey root = SigningKey::Generate();
    const std::string other_id = trust_.session_id == kOtherId ? kYetAnotherId : kOtherId;
    for (const std::string& id : {trust_.session_id, other_id}) {
      const Credential credential = IssueCredential(root, id, Role::kWorker, "steady", 0);
      Expect(false,
             id == other_id ? "another session's credential"
                            : "another root's credential for this session",
             {AdviceOf({{id, root.public_key()}, credential, {}})});
    }
    Expect(false, "this session's credential, signed for another session",
           {AdviceOf({{other_id, trust_.root}, worker_.credential, {}})});
  }

  void Expire() {
    const int64_t expires_s = NowUs() / 1'000'000 + kShortLifeS;
    const SessionAccess access = Invite("short-lived", expires_s);
    Expect(true, "before its certificate expires", {AdviceOf(access)});
    while (NowUs() / 1'000'000 < expires_s) trial_->loop().RunUntil([] { return false; }, 0.1);
    Expect(false, "after its certificate expires", {AdviceOf(access)});
    Certificate prolonged = access.credential.certificate;
    prolonged.expires_s = 0;
    Expect(false, "with a later expiry in it", {AdviceOf(With(access.credential.key, prolonged))});
  }

  // Who checks looks at the list once a second.
  void Revoke() {
    const SessionAccess access = Invite("lost");
    Expect(true, "before it is revoked", {AdviceOf(access)});
    const Status revoked = RevokeName(session_.paths.Keys().string(), "lost");
    if (!revoked.ok()) throw std::runtime_error(revoked.error());
    const double deadline_s = trial_->loop().now_s() + kRevokedWithinS;
    while (trial_->Say(mouth_.get(), {AdviceOf(access)}).front()) {
      if (trial_->loop().now_s() > deadline_s) break;
      trial_->loop().RunUntil([] { return false; }, 0.1);
    }
    Expect(false, "after it is revoked", {AdviceOf(access), AdviceOf(access)});
  }

  static constexpr char kOtherId[] = "0123456789abcdef", kYetAnotherId[] = "fedcba9876543210";
  static constexpr int64_t kShortLifeS = 5;
  static constexpr double kRevokedWithinS = 10;

  Trial* const trial_;
  const Session session_;
  const SessionTrust trust_;
  const std::unique_ptr<Mouth> mouth_;
  const SessionAccess worker_;
  MessageSeal seal_;
  int64_t num_made_ = 0;
  bool is_right_ = true;
};

struct Options {
  std::string what;
  bool at_relay = false;
  bool takes_unsigned = false;
  LcmUrl url;
  std::string session_dir;
  std::vector<std::string> links;
};

std::optional<Options> ParseArguments(int argc, char** argv) {
  if (argc < 6) return std::nullopt;
  const std::string what = argv[1], where = argv[2], auth = argv[3];
  if (what != "table" && what != "names" && what != "attacks") return std::nullopt;
  if (where != "relay" && where != "receiver") return std::nullopt;
  if (auth != "require" && auth != "warn") return std::nullopt;
  return Options{what,    where == "relay",       auth == "warn", ParseLcmUrl(argv[4]),
                 argv[5], {argv + 6, argv + argc}};
}

std::vector<Speaking> AllRoles(const Options& options,
                               const std::function<SessionAccess(Role, const char*)>& own) {
  std::vector<Speaking> roles;
  for (const std::string& link : options.links) {
    const Invitation invitation = Need(ReadInvitation(link));
    roles.push_back(SpeakingAs({invitation.trust, invitation.credential, {}}));
  }
  roles.push_back(SpeakingAs(own(Role::kIngest, "ingest")));
  roles.push_back(SpeakingAs(own(Role::kWeb, "web")));
  roles.push_back({"unsigned", {"nobody", AgentInstance("nobody")}, std::nullopt});
  return roles;
}

int Run(const Options& options) {
  PollLoop loop;
  const Session session = Need(OpenOrCreateSession(options.session_dir));
  const std::string keys_dir = session.paths.Keys().string();
  const auto own = [&](Role role, const char* name) {
    return Need(OpenSessionKeys(keys_dir, session.session_id, role, name));
  };
  const SessionAccess listener = own(Role::kViewer, "listener");
  std::unique_ptr<Ear> ear;
  ReceiverEar* receiver = nullptr;
  if (options.at_relay) {
    ear = std::make_unique<RawEar>(loop, options.url);
  } else {
    ear = std::make_unique<ReceiverEar>(loop, options.url, listener, keys_dir,
                                        options.takes_unsigned);
    receiver = static_cast<ReceiverEar*>(ear.get());
  }
  Trial trial(loop, options.url, ear.get(), own(Role::kViewer, "marker"));
  bool is_right = true;
  if (options.what == "attacks") {
    is_right = Attacks(&trial, session, listener.trust).Run();
  } else {
    std::optional<Name> as;
    if (options.what == "names") as = Name{"somebody", "somebody"};
    PrintTable(&trial, AllRoles(options, own), as);
  }
  const int64_t num_refused = trial.num_sent() - trial.num_heard();
  if (receiver != nullptr && receiver->num_refused() != num_refused) {
    throw std::runtime_error("refused " + std::to_string(num_refused) + ", counted " +
                             std::to_string(receiver->num_refused()));
  }
  std::printf("sent %ld, heard %ld, refused %ld\n", trial.num_sent(), trial.num_heard(),
              num_refused);
  return is_right ? 0 : 1;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::InitLog("role_matrix", false);
  try {
    const auto options = skein::ParseArguments(argc, argv);
    if (options) return skein::Run(*options);
    std::fprintf(stderr,
                 "usage: role_matrix table|names|attacks relay|receiver require|warn URL SESSION "
                 "LINK...\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "role_matrix: %s\n", error.what());
    return 1;
  }
}
