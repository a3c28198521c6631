// The live view's process: follows the ledger, hears processes and mappers, and shows all that.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "event_loop/alive.h"
#include "http/job_pool.h"
#include "http/web_server.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "shapes/dense_follower.h"
#include "shapes/shape_follower.h"
#include "web/finish_asker.h"
#include "web/session_api.h"
#include "web/session_view.h"
#include "web/status_message.h"
#include "web/upload_desk.h"
#include "web/uploads_api.h"
#include "web/visitors.h"
#include "web/web_options.h"

namespace skein {

// WebService restores its state from the ledger and the folder uploads/, so it may die and return
// at any time.
class WebService {
 public:
  // Throws std::runtime_error where it cannot listen.
  WebService(Node& node, const WebOptions& options);
  ~WebService();
  WebService(const WebService&) = delete;
  WebService& operator=(const WebService&) = delete;

  int port() const { return server_->port(); }

 private:
  SessionSource Source();
  UploadNews News();
  void AddVisitors(SessionSource* source);
  ShapeFollowerOptions FollowShapes();
  std::unique_ptr<DenseFollower> FollowDense();
  void StartServer();
  void Fetch(const std::string& blob_id, const std::string& owner, SessionSource::Done done);
  void OnFact(const Fact& fact);
  void OnHeartbeat(const heartbeat_t& heartbeat);
  void OnGuidance(const guidance_t& guidance);
  void OnAdvice(const advice_t& advice);
  std::optional<advice_t> AdviceFor(const std::string& agent) const;
  std::vector<Trouble> Troubles() const;
  HeardProcesses ProcessesHeard() const;
  void TellStatus();

  Node& node_;
  const WebOptions options_;
  SessionView view_;
  std::atomic<bool> has_read_ledger_{false};  // once
  std::optional<Visitors> visitors_;          // with a pass; none: no pass counts
  std::unique_ptr<UploadStore> uploads_;      // null: nobody comes from other hosts
  std::unique_ptr<UploadsApi> uploads_api_;   // of `uploads_`
  std::unique_ptr<SessionApi> api_;
  std::unique_ptr<JobPool> upload_jobs_;  // use all three, and look who was revoked
  std::unique_ptr<ShapeFollower> shapes_;
  std::unique_ptr<DenseFollower> dense_;
  std::unique_ptr<WebServer> server_;
  std::unique_ptr<LedgerFollower> follower_;
  std::unique_ptr<UploadDesk> desk_;
  std::unique_ptr<FinishAsker> finish_asker_;
  HeardProcesses processes_;
  const double listens_since_s_;
  mutable std::mutex told_mutex_;  // guards the next three
  HeardGuidance guidance_;
  std::vector<Trouble> troubles_;
  HeardProcesses heard_processes_;  // of processes_, as of the last TellStatus
  std::string told_status_;
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
