#include "transport/stream.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace skein {
namespace {

bool IsForNow(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

Stream::~Stream() { ::close(fd_); }

Stream::Moved Stream::Over(std::string why, bool is_fault) {
  error_ = std::move(why);
  is_fault_ = is_fault;
  return {0, true};
}

Stream::Moved Stream::Receive(uint8_t* buffer, size_t size) {
  const ssize_t got = ::recv(fd_, buffer, size, 0);
  if (got > 0) return {static_cast<size_t>(got), false};
  if (got == 0) return Over("it hung up");
  return IsForNow(errno) ? Moved{} : Over(std::strerror(errno));
}

Stream::Moved Stream::Send(const uint8_t* data, size_t size) {
  const ssize_t sent = ::send(fd_, data, size, MSG_NOSIGNAL);
  if (sent >= 0) return {static_cast<size_t>(sent), false};
  return IsForNow(errno) ? Moved{} : Over(std::strerror(errno));
}

}  // namespace skein
