#include "photo/photo_decoder.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <ctime>
#include <utility>

#include "core/log.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr char kProgramName[] = "skein-decoder";
constexpr int kRoundMs = 1000;
constexpr int kEndsWithinMs = 5000;  // after its socket closed
// Above the descriptors that the child gets, so that placing one overwrites no other.
constexpr int kFirstFreeFd = kDecoderOutput + 1;

// What decoding takes beside input and output. The most that the codecs allocate for a pixel:
// coefficients of a progressive CMYK JPEG 8 bytes, a strip of a TIFF of 4 doubles 32 bytes.
constexpr uint64_t kBytesPerPixel = 32;
constexpr uint64_t kSpareBytes = uint64_t{128} << 20;
// Of input and output, from one photo to the next.
constexpr size_t kKeptBytes = size_t{128} << 20;
constexpr uint64_t kPixelsPerCpuLimit = 20'000'000;

// Sanitizers reserve terabytes.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitsMemory = false;
#elif defined(__has_feature)
constexpr bool kLimitsMemory = !__has_feature(address_sanitizer);
#else
constexpr bool kLimitsMemory = true;
#endif

std::string WithErrno(const std::string& what) { return what + ": " + std::strerror(errno); }

std::string BesideThisProgram() {
  std::array<char, PATH_MAX> path{};
  const ssize_t size = readlink("/proc/self/exe", path.data(), path.size());
  const std::string self(path.data(), size > 0 ? static_cast<size_t>(size) : 0);
  return self.substr(0, self.rfind('/') + 1) + kProgramName;
}

// An end of a socket or a descriptor of shared memory, out of the way of 0 to 5.
int MovedUp(int fd) { return fcntl(fd, F_DUPFD_CLOEXEC, kFirstFreeFd); }

// The child begins with three descriptors of ours, default signals and a process group of its own:
// Ctrl-C is for the parent.
class SpawnSettings {
 public:
  SpawnSettings() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  void Pass(int fd, int as) { posix_spawn_file_actions_adddup2(&actions, fd, as); }
  void CloseTheRest() { posix_spawn_file_actions_addclosefrom_np(&actions, kFirstFreeFd); }

  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
};

Result<pid_t> SpawnWith(const std::string& program, const std::array<int, 3>& fds) {
  SpawnSettings settings;
  settings.Pass(fds[0], kDecoderSocket);
  settings.Pass(fds[1], kDecoderInput);
  settings.Pass(fds[2], kDecoderOutput);
  settings.CloseTheRest();
  char* const arguments[] = {const_cast<char*>(program.c_str()), nullptr};
  pid_t pid = 0;
  const int error = posix_spawn(&pid, program.c_str(), &settings.actions, &settings.attributes,
                                arguments, environ);
  if (error != 0) {
    return Unavailable("cannot start " + program + ": " + std::strerror(error) +
                       "; it is built with the target skein-decoder");
  }
  return pid;
}

// The header of glibc 2.36 does not declare pidfd_open for C++.
int PidFd(pid_t pid) { return static_cast<int>(syscall(SYS_pidfd_open, pid, 0)); }

bool IsFromOutside(int signal) {
  return signal == SIGKILL || signal == SIGTERM || signal == SIGINT || signal == SIGHUP ||
         signal == SIGQUIT;
}

Status HowItEnded(int status) {
  if (!WIFSIGNALED(status)) {
    return DataLoss("the decoder ended with exit code " + std::to_string(WEXITSTATUS(status)));
  }
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU) return DataLoss("the decoder took too much processor time");
  const char* name = sigabbrev_np(signal);
  const std::string text =
      "the decoder ended by " +
      (name != nullptr ? std::string("SIG") + name : "signal " + std::to_string(signal));
  return IsFromOutside(signal) ? Unavailable(text) : DataLoss(text);
}

}  // namespace

class PhotoDecoder::Child {
 public:
  static Result<std::unique_ptr<Child>> Spawn(const std::string& program, int input, int output);
  // Ends it, if it lives.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // False: it is not there any more.
  bool Send(const Bytes& message);
  // Its next message; else why there is none, and then this object is of no use any more.
  Result<DecoderAnswer> Receive(int max_still_s);

  // From now on.
  Status LimitCpu(int seconds);
  Status LimitMemory(uint64_t bytes);

  uint64_t base_bytes = 0;  // of address space, before the first photo

 private:
  Child(pid_t pid, int pid_fd, int socket) : pid_(pid), pid_fd_(pid_fd), socket_(socket) {}
  Result<DecoderAnswer> ReadMessage();
  Status Reap();
  double CpuS() const;

  pid_t pid_;  // -1: reaped
  const int pid_fd_;
  const int socket_;
};

Result<std::unique_ptr<PhotoDecoder::Child>> PhotoDecoder::Child::Spawn(const std::string& program,
                                                                        int input, int output) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Unavailable(WithErrno("no socket for a decoder"));
  }
  const std::array<int, 3> fds = {MovedUp(ends[1]), MovedUp(input), MovedUp(output)};
  close(ends[1]);
  const bool moved = fds[0] >= 0 && fds[1] >= 0 && fds[2] >= 0;
  const Result<pid_t> pid =
      moved ? SpawnWith(program, fds) : Result<pid_t>(Unavailable(WithErrno("no decoder")));
  for (const int fd : fds) close(fd);
  if (!pid.ok()) {
    close(ends[0]);
    return pid.status();
  }
  return std::unique_ptr<Child>(new Child(*pid, PidFd(*pid), ends[0]));
}

PhotoDecoder::Child::~Child() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    Reap();
  }
  close(socket_);
  if (pid_fd_ >= 0) close(pid_fd_);
}

bool PhotoDecoder::Child::Send(const Bytes& message) {
  ssize_t sent = 0;
  do {
    sent = send(socket_, message.data(), message.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(message.size());
}

// Time is counted in rounds of this process: a pause of the machine blames nobody.
Result<DecoderAnswer> PhotoDecoder::Child::Receive(int max_still_s) {
  double cpu_s = CpuS();
  for (int still_s = 0; still_s < max_still_s;) {
    pollfd socket{socket_, POLLIN, 0};
    const int ready = poll(&socket, 1, kRoundMs);
    if (ready > 0) return ReadMessage();
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) return Unavailable(WithErrno("cannot wait for the decoder"));
    const double now_s = CpuS();
    still_s = now_s > cpu_s ? 0 : still_s + 1;
    cpu_s = now_s;
  }
  return DataLoss("the decoder did nothing for " + std::to_string(max_still_s) + " s");
}

Result<DecoderAnswer> PhotoDecoder::Child::ReadMessage() {
  std::array<uint8_t, kMaxDecoderMessage> message;
  ssize_t size = 0;
  do {
    size = recv(socket_, message.data(), message.size(), 0);
  } while (size < 0 && errno == EINTR);
  if (size > 0) return ParseDecoderAnswer(message.data(), static_cast<size_t>(size));
  // The socket closes before the process has ended.
  pollfd ended{pid_fd_, POLLIN, 0};
  if (poll(&ended, 1, kEndsWithinMs) <= 0) kill(pid_, SIGKILL);
  return Reap();
}

Status PhotoDecoder::Child::Reap() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) continue;
  pid_ = -1;
  return HowItEnded(status);
}

double PhotoDecoder::Child::CpuS() const {
  clockid_t clock = 0;
  timespec time{};
  if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

Status PhotoDecoder::Child::LimitCpu(int seconds) {
  const rlimit limit{static_cast<rlim_t>(CpuS()) + 1 + static_cast<rlim_t>(seconds), RLIM_INFINITY};
  if (prlimit(pid_, RLIMIT_CPU, &limit, nullptr) == 0) return Status::Ok();
  return Unavailable(WithErrno("cannot limit the decoder's processor time"));
}

Status PhotoDecoder::Child::LimitMemory(uint64_t bytes) {
  const rlimit limit{base_bytes + bytes, RLIM_INFINITY};
  if (!kLimitsMemory || prlimit(pid_, RLIMIT_AS, &limit, nullptr) == 0) return Status::Ok();
  return Unavailable(WithErrno("cannot limit the decoder's memory"));
}

Result<std::unique_ptr<PhotoDecoder>> PhotoDecoder::Start(DecoderOptions options) {
  if (options.program.empty()) options.program = BesideThisProgram();
  Result<SharedMemory> input = SharedMemory::Make("skein-photo");
  if (!input.ok()) return input.status();
  Result<SharedMemory> output = SharedMemory::Make("skein-pixels");
  if (!output.ok()) return output.status();
  std::unique_ptr<PhotoDecoder> decoder(
      new PhotoDecoder(std::move(options), *std::move(input), *std::move(output)));
  if (Status status = decoder->StartChild(); !status.ok()) return status;
  return Result<std::unique_ptr<PhotoDecoder>>(std::move(decoder));
}

PhotoDecoder::PhotoDecoder(DecoderOptions options, SharedMemory input, SharedMemory output)
    : options_(std::move(options)), input_(std::move(input)), output_(std::move(output)) {}

PhotoDecoder::~PhotoDecoder() = default;

// Its first message comes when it has confined itself.
Status PhotoDecoder::StartChild() {
  auto child = Child::Spawn(options_.program, input_.fd(), output_.fd());
  if (!child.ok()) return child.status();
  if (Status status = (*child)->LimitCpu(options_.bounds.max_cpu_s); !status.ok()) return status;
  const Result<DecoderAnswer> ready = (*child)->Receive(options_.bounds.max_still_s);
  const Status status = ready.ok() ? ready->status : ready.status();
  if (!status.ok()) return Unavailable(options_.program + " does not start: " + status.error());
  (*child)->base_bytes = ready->address_space_bytes;
  child_ = *std::move(child);
  return Status::Ok();
}

Result<CheckedPhoto> PhotoDecoder::Check(const Bytes& photo, const PhotoLimits& limits) {
  const Result<PhotoHeader> header = CheckHeader(photo, limits);
  if (!header.ok()) return header.status();
  const Result<DecoderAnswer> answer =
      Ask({DecoderRequest::Kind::kCheck, photo.size(), *header}, photo);
  if (!answer.ok()) return answer.status();
  return CheckedPhoto{*header, answer->exif};
}

Result<DecodedPhoto> PhotoDecoder::Decode(const Bytes& photo, int64_t min_side_px,
                                          int64_t max_pixels) {
  PhotoLimits limits;
  limits.max_bytes = kMaxPhotoBytes;
  limits.max_pixels = max_pixels;
  limits.min_side_px = 1;
  const Result<PhotoHeader> header = CheckHeader(photo, limits);
  if (!header.ok()) return header.status();
  const int reduction = min_side_px > 0 ? ReductionFor(*header, min_side_px) : 1;
  const Result<DecoderAnswer> answer =
      Ask({DecoderRequest::Kind::kDecode, photo.size(), *header, static_cast<uint8_t>(reduction)},
          photo);
  if (!answer.ok()) return answer.status();
  const auto side = [reduction](int64_t px) {
    return static_cast<int>(ReducedSide(px, reduction));
  };
  return DecodedPhoto{
      cv::Mat(side(header->height_px), side(header->width_px), CV_8UC3, output_.data()), *header,
      reduction};
}

// An error of the answer's status is an error here.
Result<DecoderAnswer> PhotoDecoder::Ask(const DecoderRequest& request, const Bytes& photo) {
  const bool decodes = request.kind == DecoderRequest::Kind::kDecode;
  input_.Release(kKeptBytes);
  output_.Release(kKeptBytes);
  if (Status status = input_.Reserve(photo.size()); !status.ok()) return status;
  if (Status status = output_.Reserve(decodes ? DecodedBytes(request) : 0); !status.ok())
    return status;
  std::memcpy(input_.data(), photo.data(), photo.size());
  if (Status status = Give(request); !status.ok()) return status;
  Result<DecoderAnswer> answer = child_->Receive(options_.bounds.max_still_s);
  if (!answer.ok()) {
    LogWarn("{}; a new one starts for the next photo", answer.error());
    child_.reset();
    return answer;
  }
  if (answer->status.ok()) return answer;
  const bool too_large = answer->status.code == StatusCode::kResourceExhausted;
  const std::string reason = Printable(answer->status.text, answer->status.text.size());
  return too_large ? ResourceExhausted(reason) : DataLoss(reason);
}

// A child that ended since the last photo is replaced.
Status PhotoDecoder::Give(const DecoderRequest& request) {
  const Bytes message = EncodeDecoderRequest(request);
  const uint64_t num_pixels = NumPixels(request.header);
  const uint64_t memory = input_.capacity() + output_.capacity() + 2 * request.photo_bytes +
                          kBytesPerPixel * num_pixels + kSpareBytes;
  const int cpu_s =
      options_.bounds.max_cpu_s * static_cast<int>(1 + num_pixels / kPixelsPerCpuLimit);
  Status status;
  for (int i = 0; i < 2; ++i) {
    if (child_ == nullptr) status = StartChild();
    if (child_ == nullptr) return status;
    status = child_->LimitCpu(cpu_s);
    if (status.ok()) status = child_->LimitMemory(memory);
    if (status.ok() && child_->Send(message)) return Status::Ok();
    child_.reset();
  }
  return status.ok() ? Unavailable("the decoder ends as soon as it has started") : status;
}

}  // namespace skein
