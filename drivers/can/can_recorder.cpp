#include "drivers/can/can_recorder.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <string_view>
#include <system_error>
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

std::string reason(int error) { return std::generic_category().message(error); }

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
  if (!fd) throw InputError(file, "cannot write the CAN log: " + reason(errno));
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

CanRecorder::CanRecorder(const CanSettings& settings, const std::filesystem::path& file)
    : carrier_(CanCarrier::open(settings, CanCarrier::Role::kListener)),
      file_(open_log(file)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_.get() < 0) throw InputError("can.log: eventfd: " + reason(errno));
  waiting_.reserve(2 * kFlushBytes);
  thread_ = std::thread([this] { run(); });
}

CanRecorder::~CanRecorder() { stop(); }

void CanRecorder::stop() {
  if (!thread_.joinable()) return;
  ::eventfd_write(wake_.get(), 1);
  thread_.join();
}

void CanRecorder::run() {
  auto flush_at = steady_clock::now() + kFlushPeriod;
  bool stopping = false;
  while (!stopping) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(flush_at - steady_clock::now());
    const auto wait = std::clamp(left, std::chrono::milliseconds(0), lost_ ? kLookPeriod : kFlushPeriod);
    pollfd polled[] = {{wake_.get(), POLLIN, 0}, {lost_ ? -1 : carrier_.descriptor(), POLLIN, 0}};
    ::poll(polled, 2, static_cast<int>(wait.count()));
    stopping = polled[0].revents != 0;
    if (lost_ && carrier_.look() == CanCarrier::Presence::kUp) {
      lost_ = false;
      reopened_.fetch_add(1, std::memory_order_relaxed);
    }
    drain();
    if (stopping || waiting_.size() >= kFlushBytes || steady_clock::now() >= flush_at) {
      write_out();
      flush_at = steady_clock::now() + kFlushPeriod;
    }
  }
  lost_to_disk_.fetch_add(std::count(waiting_.begin(), waiting_.end(), '\n'), std::memory_order_relaxed);
}

/// At most as many frames as fit between two looks at the clock.
void CanRecorder::drain() {
  for (int i = 0; i < 1000 && carrier_.descriptor() >= 0; ++i)
    if (!take_one()) return;
}

bool CanRecorder::take_one() {
  const CanDatagram datagram = receive_datagram(carrier_.descriptor());
  if (datagram.bytes < 0) {
    if (datagram.error == EINTR || datagram.error == ECONNRESET) return true;
    if (datagram.error != EAGAIN) lost_ = true;
    return false;
  }
  if (datagram.bytes == 0 && at_end(carrier_.descriptor())) {
    carrier_.lose();
    lost_ = true;
    return false;
  }
  if (datagram.drops) receive_dropped_.fetch_add(*datagram.drops - std::exchange(drops_told_, *datagram.drops));
  if (!datagram.classic() && !datagram.fd()) {
    malformed_.fetch_add(1, std::memory_order_relaxed);
    return true;
  }
  CanLogEntry entry;
  entry.wall_ns = wall_ns(datagram.wall);
  entry.interface = carrier_.name();
  entry.fd = datagram.fd();
  entry.frame.can_id = datagram.frame.can_id;
  entry.frame.len = datagram.frame.len;
  if (entry.fd) entry.frame.flags = datagram.frame.flags;
  std::copy_n(datagram.frame.data, datagram.frame.len, entry.frame.data);
  line_.clear();
  append_line(entry, line_);
  line_ += '\n';
  take_line(line_);
  return true;
}

void CanRecorder::take_line(const std::string& line) {
  if (waiting_.size() + line.size() > kMostBytesWaiting) {
    lost_to_disk_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  waiting_ += line;
}

void CanRecorder::write_out() {
  std::size_t done = 0;
  while (done < waiting_.size()) {
    const ssize_t n = ::write(file_.get(), waiting_.data() + done, waiting_.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      write_errors_.fetch_add(1, std::memory_order_relaxed);
      disk_errno_.store(n < 0 ? errno : ENOSPC, std::memory_order_relaxed);
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  const auto lines = std::count(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(done), '\n');
  recorded_.fetch_add(lines, std::memory_order_relaxed);
  waiting_.erase(0, done);
}

CanRecorderCounters CanRecorder::counters() const noexcept {
  const auto read = [](const auto& count) { return count.load(std::memory_order_relaxed); };
  CanRecorderCounters c;
  c.recorded = read(recorded_);
  c.receive_dropped = read(receive_dropped_);
  c.malformed = read(malformed_);
  c.lost_to_disk = read(lost_to_disk_);
  c.write_errors = read(write_errors_);
  c.reopened = read(reopened_);
  c.disk_errno = read(disk_errno_);
  return c;
}

}  // namespace tankrig
