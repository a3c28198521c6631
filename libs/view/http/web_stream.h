// A connection as Boost.Beast takes it: bytes as they are, or through TLS.
#pragma once

#include <boost/beast/ssl.hpp>
#include <memory>
#include <utility>

#include "http/asio.h"

namespace skein {

class WebStream {
 public:
  using executor_type = beast::tcp_stream::executor_type;

  explicit WebStream(tcp::socket socket)
      : plain_(std::make_unique<beast::tcp_stream>(std::move(socket))) {}
  WebStream(tcp::socket socket, asio::ssl::context& context)
      : tls_(std::make_unique<Tls>(std::move(socket), context)) {}

  bool is_encrypted() const { return tls_ != nullptr; }
  beast::tcp_stream& lowest() { return tls_ ? tls_->next_layer() : *plain_; }
  executor_type get_executor() { return lowest().get_executor(); }

  template <class Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(asio::ssl::stream_base::server, std::forward<Handler>(handler));
  }

  // As AsyncReadStream and AsyncWriteStream of Boost.Asio, for handlers that are functions.
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    tls_ ? tls_->async_read_some(buffers, std::forward<Handler>(handler))
         : plain_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    tls_ ? tls_->async_write_some(buffers, std::forward<Handler>(handler))
         : plain_->async_write_some(buffers, std::forward<Handler>(handler));
  }

 private:
  using Tls = beast::ssl_stream<beast::tcp_stream>;
  std::unique_ptr<beast::tcp_stream> plain_;
  std::unique_ptr<Tls> tls_;
};

// Ends of a WebSocket: the connection is closed, as this server says no TLS goodbye.
inline void teardown(beast::role_type, WebStream& stream, ErrorCode& error) {
  stream.lowest().socket().shutdown(tcp::socket::shutdown_both, error);
}
template <class Handler>
void async_teardown(beast::role_type, WebStream& stream, Handler&& handler) {
  ErrorCode error;
  stream.lowest().socket().shutdown(tcp::socket::shutdown_both, error);
  asio::post(stream.get_executor(),
             beast::bind_front_handler(std::forward<Handler>(handler), error));
}

// Closes a WebSocket whose peer does not answer.
inline void beast_close_socket(WebStream& stream) { stream.lowest().close(); }

}  // namespace skein
