// The live view's process: follows the ledger, hears processes and mappers, and shows all that.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "event_loop/alive.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "web/session_api.h"
#include "web/session_view.h"
#include "web/shape_follower.h"
#include "web/status_message.h"
#include "web/web_options.h"
#include "web/web_server.h"

namespace skein {

// Only reads. What it holds comes from the ledger, so it may die and return at any time.
class WebService {
 public:
  // Throws std::runtime_error where it cannot listen.
  WebService(Node& node, const WebOptions& options);
  ~WebService();
  WebService(const WebService&) = delete;
  WebService& operator=(const WebService&) = delete;

  int port() const { return server_->port(); }

 private:
  SessionSource Source(const WebOptions& options);
  void Fetch(const std::string& blob_id, const std::string& owner, SessionSource::Done done);
  void OnFact(const Fact& fact);
  void OnHeartbeat(const heartbeat_t& heartbeat);
  void TellStatus();

  Node& node_;
  SessionView view_;
  std::unique_ptr<SessionApi> api_;
  std::unique_ptr<ShapeFollower> shapes_;
  std::unique_ptr<WebServer> server_;
  std::unique_ptr<LedgerFollower> follower_;
  HeardProcesses processes_;
  std::string told_status_;
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
