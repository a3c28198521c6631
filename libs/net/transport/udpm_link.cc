#include "transport/udpm_link.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <stdexcept>

namespace skein {
namespace {

constexpr uint32_t kMagic = 0x4c433032;  // "LC02"
constexpr size_t kHeaderBytes = 8;
constexpr size_t kMaxChannelBytes = 63;
constexpr size_t kMaxDatagram = 65535;
constexpr size_t kMaxQueuedBytes = 16 << 20;
// What the allocator adds to each allocation, at most.
constexpr size_t kAllocationBytes = 32;

uint32_t ReadUint32(const uint8_t* data) {
  return uint32_t{data[0]} << 24 | uint32_t{data[1]} << 16 | uint32_t{data[2]} << 8 | data[3];
}

void AppendUint32(uint32_t value, Bytes* out) {
  for (const int shift : {24, 16, 8, 0}) out->push_back(static_cast<uint8_t>(value >> shift));
}

[[noreturn]] void Fail(const LcmUrl& url, const std::string& what) {
  throw std::runtime_error("cannot " + what + " " + url.ToString() + ": " + std::strerror(errno) +
                           "; is multicast routed here (`ip route get " + url.host +
                           "`)? For this computer alone: `sudo ip route add 224.0.0.0/4 dev lo`, "
                           "or a tcpq:// URL");
}

sockaddr_in AddressOf(const LcmUrl& url) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(url.port));
  if (inet_pton(AF_INET, url.host.c_str(), &address.sin_addr) != 1 ||
      !IN_MULTICAST(ntohl(address.sin_addr.s_addr))) {
    throw std::runtime_error(url.host + " is no IPv4 multicast group: write udpm://239.255.76.67:" +
                             std::to_string(url.port));
  }
  return address;
}

int OpenSocket(const LcmUrl& url) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) Fail(url, "open a socket for");
  return fd;
}

// Memory that it takes while it waits: itself and two allocations.
size_t CostOf(const LcmDatagram& datagram) {
  return sizeof(datagram) + datagram.channel.size() + datagram.message.size() +
         2 * kAllocationBytes;
}

template <class T>
void SetOption(int fd, int level, int name, const T& value) {
  setsockopt(fd, level, name, &value, sizeof(value));
}

}  // namespace

std::optional<LcmDatagram> ParseLcmDatagram(const uint8_t* data, size_t size) {
  if (size < kHeaderBytes || ReadUint32(data) != kMagic) return std::nullopt;
  const auto* name = reinterpret_cast<const char*>(data + kHeaderBytes);
  const size_t length = strnlen(name, size - kHeaderBytes);
  if (length == 0 || length > kMaxChannelBytes || length == size - kHeaderBytes) {
    return std::nullopt;
  }
  return LcmDatagram{std::string(name, length),
                     Bytes(data + kHeaderBytes + length + 1, data + size)};
}

Bytes MakeLcmDatagram(uint32_t sequence_number, const std::string& channel, const void* data,
                      size_t size) {
  Bytes datagram;
  datagram.reserve(kHeaderBytes + channel.size() + 1 + size);
  AppendUint32(kMagic, &datagram);
  AppendUint32(sequence_number, &datagram);
  datagram.insert(datagram.end(), channel.begin(), channel.end());
  datagram.push_back(0);
  const auto* bytes = static_cast<const uint8_t*>(data);
  datagram.insert(datagram.end(), bytes, bytes + size);
  return datagram;
}

bool DatagramQueue::Push(LcmDatagram datagram) {
  const size_t cost = CostOf(datagram);
  if (cost > max_bytes_ - bytes_) return false;
  bytes_ += cost;
  datagrams_.push_back(std::move(datagram));
  return true;
}

std::optional<LcmDatagram> DatagramQueue::Pop() {
  if (datagrams_.empty()) return std::nullopt;
  LcmDatagram datagram = std::move(datagrams_.front());
  datagrams_.pop_front();
  bytes_ -= CostOf(datagram);
  return datagram;
}

UdpmLink::UdpmLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message)
    : url_(url), loop_(loop), on_message_(std::move(on_message)), received_(kMaxQueuedBytes) {
  const sockaddr_in address = AddressOf(url);
  send_fd_ = OpenSocket(url);
  SetOption(send_fd_, IPPROTO_IP, IP_MULTICAST_TTL, static_cast<uint8_t>(url.ttl));
  SetOption(send_fd_, IPPROTO_IP, IP_MULTICAST_LOOP, uint8_t{1});
  if (connect(send_fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    close(send_fd_);
    Fail(url, "reach");
  }
}

UdpmLink::~UdpmLink() {
  if (reader_.joinable()) {
    const uint64_t one = 1;
    if (write(stop_fd_, &one, sizeof(one)) < 0) std::terminate();  // an eventfd takes it
    reader_.join();
  }
  for (const int fd : {send_fd_, receive_fd_, stop_fd_}) {
    if (fd >= 0) close(fd);
  }
}

void UdpmLink::Subscribe(const std::string& channel) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    channels_.insert(channel);
  }
  if (receive_fd_ < 0) Join();
}

void UdpmLink::Unsubscribe(const std::string& channel) {
  const std::lock_guard<std::mutex> lock(mutex_);
  channels_.erase(channel);
}

// Bound to the group, so that nothing sent to this host alone arrives.
void UdpmLink::Join() {
  const sockaddr_in address = AddressOf(url_);
  receive_fd_ = OpenSocket(url_);
  SetOption(receive_fd_, SOL_SOCKET, SO_REUSEADDR, 1);
  SetOption(receive_fd_, SOL_SOCKET, SO_RCVBUF, url_.recv_buf_size);
  if (bind(receive_fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    Fail(url_, "listen to");
  }
  ip_mreq group{};
  group.imr_multiaddr = address.sin_addr;
  if (setsockopt(receive_fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof(group)) != 0) {
    Fail(url_, "join");
  }
  stop_fd_ = eventfd(0, EFD_CLOEXEC);
  if (stop_fd_ < 0) Fail(url_, "listen to");
  reader_ = std::thread([this] { Read(); });
}

bool UdpmLink::Publish(const std::string& channel, const void* data, size_t size) {
  Bytes datagram = MakeLcmDatagram(sequence_number_++, channel, data, size);
  iovec part{datagram.data(), datagram.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  return sendmsg(send_fd_, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(datagram.size());
}

void UdpmLink::Read() {
  Bytes buffer(kMaxDatagram);
  pollfd fds[] = {{receive_fd_, POLLIN, 0}, {stop_fd_, POLLIN, 0}};
  for (;;) {
    if (poll(fds, 2, -1) < 0) continue;  // a signal
    if (fds[1].revents != 0) return;
    const ssize_t size = recv(receive_fd_, buffer.data(), buffer.size(), 0);
    if (size < 0) continue;
    if (auto datagram = ParseLcmDatagram(buffer.data(), static_cast<size_t>(size))) {
      Queue(std::move(*datagram));
    }
  }
}

void UdpmLink::Queue(LcmDatagram datagram) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (channels_.count(datagram.channel) == 0 || !received_.Push(std::move(datagram))) return;
  if (received_.size() == 1) loop_.Post(alive_.Guarded([this] { Deliver(); }));
}

void UdpmLink::Deliver() {
  for (int i = 0; i < kMaxBatch; ++i) {
    std::optional<LcmDatagram> datagram;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      datagram = received_.Pop();
      if (!datagram) return;
      if (channels_.count(datagram->channel) == 0) continue;
    }
    on_message_(datagram->channel, datagram->message);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (received_.size() > 0) loop_.Post(alive_.Guarded([this] { Deliver(); }));
}

}  // namespace skein
