#include "event_loop/poll_loop.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/log.h"

namespace skein {
namespace {

// The self-pipe through which the signal handler reaches the loop: [read, write].
int signal_pipe[2] = {-1, -1};

void OnSignal(int) {
  const int saved_errno = errno;
  const char byte = 0;
  // A full pipe holds a signal already.
  [[maybe_unused]] const ssize_t written = ::write(signal_pipe[1], &byte, 1);
  errno = saved_errno;
}

[[noreturn]] void ThrowSystemError(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

}  // namespace

PollLoop::PollLoop(Clock clock)
    : clock_(std::move(clock)), wake_fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_fd_ < 0) ThrowSystemError("eventfd");
  AddFd(wake_fd_, [this] {
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = ::read(wake_fd_, &count, sizeof(count));
  });
}

PollLoop::~PollLoop() {
  if (handles_signals_) {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    ::close(signal_pipe[0]);
    ::close(signal_pipe[1]);
    signal_pipe[0] = signal_pipe[1] = -1;
  }
  ::close(wake_fd_);
}

void PollLoop::AddFd(int fd, Handler on_readable) {
  auto descriptor = std::make_shared<Descriptor>(Descriptor{std::move(on_readable), {}});
  if (!descriptors_.emplace(fd, std::move(descriptor)).second) {
    throw std::logic_error("PollLoop: descriptor " + std::to_string(fd) + " is added already");
  }
}

void PollLoop::SetOnWritable(int fd, Handler on_writable) {
  const auto& old = descriptors_.at(fd);
  // A new entry: the old one's handler may be running.
  descriptors_[fd] =
      std::make_shared<Descriptor>(Descriptor{old->on_readable, std::move(on_writable)});
}

void PollLoop::RemoveFd(int fd) { descriptors_.erase(fd); }

PollLoop::TimerId PollLoop::AddTimer(double period_s, Handler handler) {
  if (!(period_s > 0)) throw std::invalid_argument("PollLoop: a timer's period must be positive");
  return AddTimerEntry(period_s, period_s, std::move(handler));
}

PollLoop::TimerId PollLoop::AddOneShot(double delay_s, Handler handler) {
  return AddTimerEntry(std::max(0.0, delay_s), 0, std::move(handler));
}

PollLoop::TimerId PollLoop::AddTimerEntry(double first_delay_s, double period_s, Handler handler) {
  const TimerId id = next_timer_id_++;
  const double due_s = now_s() + first_delay_s;
  timers_[id] = {period_s, due_s, std::make_shared<Handler>(std::move(handler))};
  due_.emplace(due_s, id);
  return id;
}

void PollLoop::CancelTimer(TimerId id) {
  const auto timer = timers_.find(id);
  if (timer == timers_.end()) return;
  due_.erase({timer->second.due_s, id});
  timers_.erase(timer);
}

void PollLoop::Post(Handler handler) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    posted_.push_back(std::move(handler));
  }
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_fd_, &one, sizeof(one));
}

void PollLoop::Stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_fd_, &one, sizeof(one));
}

void PollLoop::StopOnSignals() {
  if (signal_pipe[0] >= 0) throw std::logic_error("PollLoop: another loop handles the signals");
  if (::pipe2(signal_pipe, O_NONBLOCK | O_CLOEXEC) != 0) ThrowSystemError("pipe2");
  handles_signals_ = true;
  AddFd(signal_pipe[0], [this] { ReadSignals(); });
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void PollLoop::ReadSignals() {
  char bytes[16];
  while (::read(signal_pipe[0], bytes, sizeof(bytes)) > 0) interrupted_ = true;
  if (interrupted_) Stop();
}

void PollLoop::Run() {
  RunUntil([] { return false; }, INFINITY);
}

bool PollLoop::RunUntil(const std::function<bool()>& done, double timeout_s) {
  const double deadline_s = MonotonicS() + timeout_s;
  while (!done()) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stopped_) return done();
    }
    const double left_s = deadline_s - MonotonicS();
    if (left_s <= 0) return done();
    RunOnce(left_s);
  }
  return true;
}

void PollLoop::RunOnce(double max_wait_s) {
  RunDescriptors(WaitMs(max_wait_s));
  RunPosted();
  RunTimers();
}

int PollLoop::WaitMs(double max_wait_s) const {
  double wait_s = max_wait_s;
  if (!due_.empty()) wait_s = std::min(wait_s, due_.begin()->first - now_s());
  return static_cast<int>(std::ceil(1e3 * std::clamp(wait_s, 0.0, 60.0)));
}

void PollLoop::RunDescriptors(int wait_ms) {
  std::vector<pollfd> polled;
  for (const auto& [fd, descriptor] : descriptors_) {
    const short events = descriptor->on_writable ? POLLIN | POLLOUT : POLLIN;
    polled.push_back({fd, events, 0});
  }
  if (::poll(polled.data(), polled.size(), wait_ms) < 0) {
    if (errno == EINTR) return;
    ThrowSystemError("poll");
  }
  for (const pollfd& entry : polled) {
    if (entry.revents != 0) CallReady(entry.fd, entry.revents);
  }
}

void PollLoop::CallReady(int fd, short events) {
  // Another handler may have removed or replaced it since the poll: look it up each time.
  if (events & (POLLIN | POLLERR | POLLHUP | POLLNVAL)) {
    const auto found = descriptors_.find(fd);
    if (found == descriptors_.end()) return;
    const auto descriptor = found->second;
    descriptor->on_readable();
  }
  if (events & POLLOUT) {
    const auto found = descriptors_.find(fd);
    if (found == descriptors_.end() || !found->second->on_writable) return;
    const auto descriptor = found->second;
    descriptor->on_writable();
  }
}

void PollLoop::RunTimers() {
  const double started_s = now_s();
  while (!due_.empty() && due_.begin()->first <= started_s) {
    const TimerId id = due_.begin()->second;
    due_.erase(due_.begin());
    RunTimer(id, started_s);
  }
}

void PollLoop::RunTimer(TimerId id, double started_s) {
  TimerEntry& timer = timers_.at(id);
  const auto handler = timer.handler;
  const bool is_periodic = timer.period_s > 0;
  if (is_periodic) {
    timer.due_s = std::max(timer.due_s + timer.period_s, started_s + 0.5 * timer.period_s);
    due_.emplace(timer.due_s, id);
  }
  const bool is_done = RunNoting("a timer", *handler);
  const auto left = timers_.find(id);
  if (is_periodic || left == timers_.end()) return;  // the handler may cancel its own timer
  if (is_done) {
    timers_.erase(left);
  } else {
    left->second.due_s = now_s() + kRetryS;
    due_.emplace(left->second.due_s, id);
  }
}

bool PollLoop::RunNoting(const std::string& source, const Handler& work) {
  const Status done = Attempt(work);
  if (done.ok()) return true;
  thrown_ = {thrown_.count + 1, source + ": " + done.error(), now_s()};
  if (IsWorthALine(thrown_.count)) {
    LogError("an exception of {} ({} so far)", thrown_.last, thrown_.count);
  }
  return false;
}

void PollLoop::RunPosted() {
  std::vector<Handler> posted;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    posted.swap(posted_);
  }
  for (Handler& handler : posted) handler();
}

}  // namespace skein
