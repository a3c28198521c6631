#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/result.h"
#include "http/access.h"
#include "http/asio.h"
#include "http/connection_host.h"

namespace skein {

// One connection of a browser, request by request. The body of a POST is kept in memory, that of a
// PATCH goes to a sink, part by part. The server's thread only; the host outlives it.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(ConnectionHost& host, int64_t id, tcp::socket socket, const Door& door);

  void Start();
  // The answer to the last request that was handed to the host.
  void Answer(HttpResponse response);
  void Close();
  // Answers that there is no room, and closes.
  void Refuse();

  // Time (MonotonicS) since which the connection is without a request under way; nullopt if one is.
  std::optional<double> waiting_since_s() const { return waiting_since_s_; }
  // Time since which a part of an answer is due, from its maker or a file; nullopt if none is.
  std::optional<double> due_since_s() const { return due_since_s_; }
  // Time since which an answer is being sent; nullopt if none is.
  std::optional<double> answering_since_s() const { return answering_since_s_; }

 private:
  struct OutgoingFile;

  void ReadRequest();
  void OnRequest();
  std::optional<HttpRequest> ParsedRequest(const UpgradeRequest& request) const;
  AccessDecision AccessOf(const HttpRequest& parsed, const UpgradeRequest& request) const;
  void AnswerFailed(const Status& status);
  void ReadSmallBody(HttpRequest request);
  void BeginUpload(const HttpRequest& request);
  void ReadUpload();
  void OnUploadRead(ErrorCode error);
  bool IsTooSlow();
  void GivePart(bool and_close);
  void EndUpload();
  void OnBadRequest(ErrorCode error);
  void AnswerAndClose(int status, const std::string& line);
  void HandOver(const HttpRequest& request);
  void AnswerFile(HttpResponse response);
  void BeginFile(const std::shared_ptr<OutgoingFile>& file);
  void ReadFilePart(const std::shared_ptr<OutgoingFile>& file);
  void WriteFilePart(const std::shared_ptr<OutgoingFile>& file);
  void AnswerHead(const HttpResponse& response);
  void AnswerBody(HttpResponse response);
  template <class Body>
  void SetFields(const HttpResponse& response, http::response<Body>* message) const;
  template <class Outgoing>
  void Write(std::shared_ptr<Outgoing> outgoing);
  template <class Outgoing>
  void WriteSome(std::shared_ptr<Outgoing> outgoing);
  void OnWritten();
  void Linger(size_t max_bytes);

  ConnectionHost& host_;
  const int64_t id_;
  const Door door_;
  const std::string local_address_;  // of the server, that the peer came to
  WebStream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<double> waiting_since_s_, due_since_s_, answering_since_s_;
  bool is_head_ = false;
  bool keep_alive_ = false;
  std::string range_;
  // State of an upload.
  std::optional<http::request_parser<http::buffer_body>> upload_parser_;
  std::shared_ptr<BodySink> sink_;
  Bytes part_;  // bytes read and not taken yet: the first part_bytes_
  size_t part_bytes_ = 0;
  double pace_since_s_ = 0;
  uint64_t pace_bytes_ = 0;
  std::array<char, 4096> lingering_;  // bytes read and dropped
  bool closed_ = false;
};

}  // namespace skein
