// A connected TCP socket that never blocks: bytes as they are, or through TLS (transport/tls.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/bytes.h"

namespace skein {

// Owns the descriptor: take it out of the loop before this ends.
class Stream {
 public:
  // Receive wants as much room, so that nothing stays behind of which poll(2) would not tell.
  static constexpr size_t kMinRoom = 16 << 10;

  struct Moved {
    size_t bytes = 0;      // 0: none now
    bool is_over = false;  // the connection has ended, error() says why
  };

  explicit Stream(int fd) : fd_(fd) {}
  virtual ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  virtual Moved Receive(uint8_t* buffer, size_t size);
  // May take a part. After 0 the same bytes are to be given again, with more behind them or not.
  virtual Moved Send(const uint8_t* data, size_t size);
  // Whether to go on once the descriptor can be written. TLS also sends where nothing is left to
  // send, and waits for the other side before it sends.
  virtual bool WaitsForRoom(bool has_output) const { return has_output; }

  // Over TLS: bytes of this connection alone, the same at both ends (RFC 9266); none before they
  // have shaken hands. In the clear: empty.
  virtual std::optional<Bytes> Binding() const { return Bytes(); }

  int fd() const { return fd_; }
  const std::string& error() const { return error_; }
  // Whether it ended because the other side did not speak as it should.
  bool is_fault() const { return is_fault_; }

 protected:
  Moved Over(std::string why, bool is_fault = false);

 private:
  const int fd_;
  std::string error_;
  bool is_fault_ = false;
};

}  // namespace skein
