// Services of the server to its connections.
#pragma once

#include <cstdint>
#include <string>

#include "http/asio.h"
#include "http/http.h"
#include "http/web_server.h"
#include "http/web_stream.h"

namespace skein {

class HttpConnection;

// The port that a connection came to.
struct Door {
  bool is_public = false;
  asio::ssl::context* tls = nullptr;  // null: in the clear
};

// The server's thread only.
class ConnectionHost {
 public:
  virtual const WebServerOptions& options() const = 0;
  // The visitor who shows a pass by the Cookie or the Authorization header.
  virtual Visitor FindVisitor(const std::string& cookies,
                              const std::string& authorization) const = 0;
  virtual std::string AgentOfPhoto(int64_t image_id) const = 0;
  // Notes who a connection is for. An error: it has no place any more, and is to be closed with it.
  virtual Status NoteVisitor(int64_t connection_id, const Visitor& visitor) = 0;
  // Has the request answered by HttpConnection::Answer of that connection.
  virtual void Handle(int64_t connection_id, const HttpRequest& request) = 0;
  // Null: nothing may be uploaded there.
  virtual std::shared_ptr<BodySink> MakeSink(const HttpRequest& request) = 0;
  // A function for a sink or a job: `then` runs on the server's thread while the connection lives.
  // With an answer, 500, if the function is dropped uncalled, as an exception of the job does.
  using OnNext = std::function<void(HttpConnection&, std::optional<HttpResponse>)>;
  virtual BodySink::Next OnServer(int64_t connection_id, OnNext then) = 0;
  // On a thread that may wait for the disk.
  virtual void RunJob(std::function<void()> job) = 0;
  // The connection goes on as a WebSocket.
  virtual void Upgrade(int64_t connection_id, WebStream stream, UpgradeRequest request) = 0;
  virtual void OnClosed(int64_t connection_id) = 0;
  // Sequence number of the last event that was sent to the pages.
  virtual int64_t sent_seq() const = 0;

 protected:
  ~ConnectionHost() = default;
};

}  // namespace skein
