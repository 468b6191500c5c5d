#include "drivers/can/can_recorder.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string_view>
#include <utility>

#include "core/input_error.hpp"
#include "drivers/can/can_datagram.hpp"
#include "drivers/can/can_log.hpp"

namespace tankrig {
namespace {

using std::chrono::steady_clock;

constexpr auto kFlushPeriod = std::chrono::milliseconds(500);
constexpr auto kLookPeriod = std::chrono::milliseconds(50);
constexpr std::size_t kFlushBytes = 64 << 10;
constexpr int kFramesPerLook = 100;

/// A kill may come in the middle of a line: nothing must be written behind it.
void remove_cut_line(int fd) {
  constexpr off_t kLongestLine = 256;
  const off_t size = ::lseek(fd, 0, SEEK_END);
  if (size <= 0) return;
  char tail[kLongestLine];
  const off_t begin = std::max<off_t>(0, size - kLongestLine);
  const ssize_t bytes = ::pread(fd, tail, sizeof tail, begin);
  const std::size_t end = std::string_view(tail, static_cast<std::size_t>(std::max<ssize_t>(bytes, 0))).rfind('\n');
  if (end != std::string_view::npos)
    (void)!::ftruncate(fd, begin + static_cast<off_t>(end) + 1);
  else if (begin == 0)
    (void)!::ftruncate(fd, 0);
}

OwnedDescriptor open_log(const std::filesystem::path& file) {
  OwnedDescriptor fd(::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  if (!fd) throw InputError(file, std::string("cannot write the CAN log: ") + std::strerror(errno));
  remove_cut_line(fd.get());
  return fd;
}

std::int64_t wall_ns(const std::optional<timespec>& stamp) {
  timespec t{};
  if (stamp)
    t = *stamp;
  else
    ::clock_gettime(CLOCK_REALTIME, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

/// All but the thread itself.
struct CanRecorder::Impl {
  using Count = std::atomic<std::uint64_t>;

  Impl(const CanSettings& settings, const std::filesystem::path& where)
      : carrier(CanCarrier::open(settings, CanCarrier::Role::kListener)),
        file(open_log(where)),
        wake(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (wake.get() < 0) throw InputError(std::string("can.log: eventfd: ") + std::strerror(errno));
    waiting.reserve(2 * kFlushBytes);
  }

  void run();
  bool drain();
  bool take_one();
  void write_out();
  void take_line();

  CanCarrier carrier;
  OwnedDescriptor file, wake;
  std::string waiting;  ///< lines not yet written
  std::string line;
  std::uint32_t drops_told = 0;
  bool lost = false;
  Count recorded{0}, receive_dropped{0}, malformed{0}, lost_to_disk{0}, write_errors{0}, reopened{0};
  std::atomic<int> disk_errno{0};

  std::mutex mutex;  ///< ended
  std::condition_variable end;
  bool ended = false;
};

CanRecorder::CanRecorder(const CanSettings& settings, const std::filesystem::path& file, Duration patience)
    : impl_(std::make_shared<Impl>(settings, file)), patience_(patience), thread_([impl = impl_] { impl->run(); }) {}

CanRecorder::~CanRecorder() { stop(); }

void CanRecorder::stop() {
  if (!thread_.joinable()) return;
  ::eventfd_write(impl_->wake.get(), 1);
  std::unique_lock lock(impl_->mutex);
  const bool ended = impl_->end.wait_for(lock, patience_, [this] { return impl_->ended; });
  lock.unlock();
  if (ended) {
    thread_.join();
    return;
  }
  impl_->write_errors.fetch_add(1, std::memory_order_relaxed);
  impl_->disk_errno.store(ETIMEDOUT, std::memory_order_relaxed);
  thread_.detach();
}

void CanRecorder::Impl::run() {
  ::pthread_setname_np(::pthread_self(), "can-log");
  auto flush_at = steady_clock::now() + kFlushPeriod;
  bool stopping = false;
  while (!stopping) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(flush_at - steady_clock::now());
    const auto wait = std::clamp(left, std::chrono::milliseconds(0), lost ? kLookPeriod : kFlushPeriod);
    pollfd polled[] = {{wake.get(), POLLIN, 0}, {lost ? -1 : carrier.descriptor(), POLLIN, 0}};
    ::poll(polled, 2, static_cast<int>(wait.count()));
    stopping = polled[0].revents != 0;
    if (lost && carrier.look() == CanCarrier::Presence::kUp) {
      lost = false;
      reopened.fetch_add(1, std::memory_order_relaxed);
    }
    while (drain() && stopping) {
    }
    if (stopping || waiting.size() >= kFlushBytes || steady_clock::now() >= flush_at) {
      write_out();
      flush_at = steady_clock::now() + kFlushPeriod;
    }
  }
  lost_to_disk.fetch_add(std::count(waiting.begin(), waiting.end(), '\n'), std::memory_order_relaxed);
  const std::lock_guard lock(mutex);
  ended = true;
  end.notify_all();
}

/// At most as many frames as fit between two looks at the clock. True: there may be more.
bool CanRecorder::Impl::drain() {
  for (int i = 0; i < kFramesPerLook; ++i)
    if (carrier.descriptor() < 0 || !take_one()) return false;
  return true;
}

bool CanRecorder::Impl::take_one() {
  const CanDatagram datagram = receive_datagram(carrier.descriptor());
  if (datagram.bytes < 0) {
    if (datagram.error == EINTR || datagram.error == ECONNRESET) return true;
    if (datagram.error != EAGAIN) lost = true;
    return false;
  }
  if (datagram.bytes == 0 && at_end(carrier.descriptor())) {
    carrier.lose();
    lost = true;
    return false;
  }
  if (datagram.drops) receive_dropped.fetch_add(*datagram.drops - std::exchange(drops_told, *datagram.drops));
  if (!datagram.classic() && !datagram.fd()) {
    malformed.fetch_add(1, std::memory_order_relaxed);
    return true;
  }
  CanLogEntry entry;
  entry.wall_ns = wall_ns(datagram.wall);
  entry.interface = carrier.name();
  entry.fd = datagram.fd();
  entry.frame.can_id = datagram.frame.can_id;
  entry.frame.len = datagram.frame.len;
  if (entry.fd) entry.frame.flags = datagram.frame.flags;
  std::copy_n(datagram.frame.data, datagram.frame.len, entry.frame.data);
  line.clear();
  append_line(entry, line);
  line += '\n';
  take_line();
  return true;
}

void CanRecorder::Impl::take_line() {
  if (waiting.size() + line.size() > kMostBytesWaiting) {
    lost_to_disk.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  waiting += line;
}

void CanRecorder::Impl::write_out() {
  std::size_t done = 0;
  while (done < waiting.size()) {
    const ssize_t n = ::write(file.get(), waiting.data() + done, waiting.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      write_errors.fetch_add(1, std::memory_order_relaxed);
      disk_errno.store(n < 0 ? errno : ENOSPC, std::memory_order_relaxed);
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  const auto lines = std::count(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(done), '\n');
  recorded.fetch_add(lines, std::memory_order_relaxed);
  waiting.erase(0, done);
}

CanRecorderCounters CanRecorder::counters() const noexcept {
  const auto read = [](const auto& count) { return count.load(std::memory_order_relaxed); };
  CanRecorderCounters c;
  c.recorded = read(impl_->recorded);
  c.receive_dropped = read(impl_->receive_dropped);
  c.malformed = read(impl_->malformed);
  c.lost_to_disk = read(impl_->lost_to_disk);
  c.write_errors = read(impl_->write_errors);
  c.reopened = read(impl_->reopened);
  c.disk_errno = read(impl_->disk_errno);
  return c;
}

}  // namespace tankrig
