// Node holds the parts of every Skein process: loop, bus, session, blobs, submissions, heartbeat.
//
// A service, whole:
//
//   int main(int argc, char** argv) {
//     skein::NodeOptions node_options;
//     node_options.service = "features";
//     skein::FeaturesOptions options;  // node/service_options.h
//     if (const auto code = skein::ParseServiceOptions("Local features of each photo.", argc, argv,
//                                                      &node_options, &options)) {
//       return *code;
//     }
//     return skein::RunService(node_options, [&](skein::Node& node) {
//       FeaturesService service(node, options);  // subscribes in its constructor
//       node.Run();                     // prints "ready features-1", runs until a signal
//     });
//   }
//
// Follow the ledger, ask for work, compute off the loop, submit:
//
//   LedgerFollower follower(node, 1, [&](const Fact& fact) {
//     if (const auto* image = std::get_if<image_t>(&fact)) images[image->image_id] = *image;
//   });
//   WorkClient work(node, "features", 1, [&](const work_t& item) {
//     node.blobs().Fetch(images.at(item.item_id).blob_id, "ingest", [&](Result<Bytes> photo) {
//       if (!photo) return work.Fail(item.item_id, photo.error(), false);
//       worker.Run([photo] { return Extract(*photo); },      // WorkerThread's thread
//                  [&](const Features& features) {           // loop's thread
//         features_t fact = ToMessage(features);
//         fact.header.fact_id = FeaturesFactId(item.item_id);
//         fact.header.computed_at_seq = follower.processed_seq();
//         fact.keypoints_blob = node.blobs().Offer(EncodeKeypoints(features.keypoints));
//         node.submitter().Submit(fact, [&](const Submission& done) {
//           if (done.committed()) work.Done(item.item_id);
//           else work.Fail(item.item_id, done.reason, true);
//         });
//       });
//     });
//   });
//
// Other messages: node.bus().Subscribe(kSomeChannel, [](const some_t& message) { ... });
// node.Publish(kSomeChannel, message); the bus fills in the session's id.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "blobs/blob_client.h"
#include "event_loop/poll_loop.h"
#include "event_loop/sign_of_life.h"
#include "event_loop/step_record.h"
#include "ledger/facts.h"
#include "ledger/submitter.h"
#include "transport/bus.h"
#include "transport/invitation.h"

namespace CLI {
class App;
}

namespace skein {

// Name and role under which a process signs (docs/security.md).
struct Signer {
  Role role = Role::kWorker;
  std::string certified_name;  // "": the instance up to its first dot
  std::string keys_dir;        // keys/ of a session's folder that this process does not share; ""
  std::optional<Invitation> invitation;  // of NodeOptions::invite
};

constexpr double kHeartbeatS = 1;  // between two heartbeats of a process

struct NodeOptions {
  std::string service;      // set by main: features, ingest, ...
  std::string session_dir;  // --session: this process shares the session folder
  std::string session_id;   // --session-id: it does not; "auto": the first session heard
  std::string lcm_url;      // --lcm-url; "": LCM_DEFAULT_URL, else LCM's default without leaving
                            // this host
  std::string auth;         // --auth: off, warn or require; "": require where the URL leaves this
                            // host, else warn
  std::string invite;       // --invite: a link, in place of session and URL
  std::string instance;     // --instance; "": the service's name
  int threads = 1;          // --threads
  bool verbose = false;     // --verbose
  size_t cache_bytes = 128 << 20;
  std::string configuration;           // the service's options, as its section of a config file
  double auto_session_timeout_s = 30;  // how long "auto" waits to hear a session

  Signer signer;
};

// --session, --session-id, --lcm-url, --auth, --invite, --instance, --threads, --verbose.
void AddCommonOptions(CLI::App& app, NodeOptions* options);
// Adds --session-id, --lcm-url, --auth and --invite alone.
void AddPlaceOptions(CLI::App& app, NodeOptions* options);

// Loop's thread only, but for what its parts say of themselves.
class Node {
 public:
  // Makes a loop, which stops on SIGINT and SIGTERM, and a bus. Throws std::invalid_argument for
  // unusable options, and std::runtime_error without a session or transport. Both texts say what to
  // do.
  explicit Node(const NodeOptions& options);
  // On the loop and the bus of others: several nodes in one process. options.session_id or
  // session_dir is set; not "auto".
  Node(const NodeOptions& options, PollLoop& loop, Bus& bus);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  // Prints "ready INSTANCE" to stdout, then runs the loop until a signal or Stop.
  void Run();
  void Stop() { loop_.Stop(); }

  PollLoop& loop() { return loop_; }
  Bus& bus() { return bus_; }
  BlobClient& blobs() { return *blobs_; }
  Submitter& submitter() { return *submitter_; }
  const NodeOptions& options() const { return options_; }
  const std::string& session_id() const { return session_id_; }
  const std::string& instance() const { return options_.instance; }
  // Present steps of the process, for the one that replaces it.
  StepRecord& steps() { return steps_; }
  // Whether this process shares the session folder, options().session_dir.
  bool shares_folder() const { return !options_.session_dir.empty(); }

  // The bus fills in the message's session.
  template <class T>
  bool Publish(const Channel<T>& channel, const T& message) {
    return bus_.Publish(channel, message);
  }

  // `fill` sets state, backlog, num_done, mean_s of the heartbeat, which goes out every second.
  void OnHeartbeat(std::function<void(heartbeat_t*)> fill) { fill_heartbeat_ = std::move(fill); }

  // A follower delivers each committed fact here, in order, before it calls its own function.
  // Observers (work clients) see the fact. With several followers each delivers.
  void NoteCommitted(const Fact& fact);
  int64_t AddFactObserver(std::function<void(const Fact&)> observer);
  void RemoveFactObserver(int64_t id) { fact_observers_.erase(id); }

 private:
  void Start();
  std::string FindSession();
  std::string HearSession();
  void SealBus();
  void SendHeartbeat();
  void KeepCounters();

  NodeOptions options_;
  StepRecord steps_;
  std::unique_ptr<PollLoop> own_loop_;
  std::unique_ptr<SignOfLife> sign_of_life_;  // of a loop of its own
  std::unique_ptr<Bus> own_bus_;
  PollLoop& loop_;
  Bus& bus_;
  std::string session_id_;
  std::unique_ptr<BlobClient> blobs_;
  std::unique_ptr<Submitter> submitter_;
  int64_t ledger_seq_ = 0;
  std::map<int64_t, std::function<void(const Fact&)>> fact_observers_;
  int64_t next_observer_ = 1;
  std::function<void(heartbeat_t*)> fill_heartbeat_;
  PollLoop::TimerId heartbeat_timer_ = 0;
  PollLoop::TimerId counters_timer_ = 0;
};

// Treatment of messages without a signature (docs/security.md).
enum class Auth { kOff, kWarn, kRequire };
// Value of --auth; "" goes by where the URL leads. Throws std::invalid_argument for anything else.
Auth AuthOf(const std::string& text, const LcmUrl& url);

// Configuration of an instance, as a fact; the fact id stays as long as the configuration does.
configuration_t ConfigurationOf(const NodeOptions& options);

// Sets up logging and threads, makes the node, submits its configuration (ingest commits its own)
// and runs `body` with it. Returns the exit code: 0 when body returned or a signal came, 2 for
// unusable options, 1 for any other failure. The log says which service failed and why.
int RunService(const NodeOptions& options, const std::function<void(Node&)>& body);

}  // namespace skein
