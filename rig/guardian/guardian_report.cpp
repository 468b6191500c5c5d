#include "rig/guardian/guardian_report.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <system_error>
#include <utility>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "rig/guardian/guardian.hpp"
#include "rig/safety/end_words.hpp"

namespace tankrig {
namespace {

constexpr Duration kPatience = std::chrono::seconds{1};  // with a terminal or a disk, at the end
constexpr Duration kLook = std::chrono::milliseconds{5};
constexpr std::uint64_t kMostBytes = 4096;

using Text = std::array<char, 1024>;

double ms(std::int64_t ns) noexcept { return 1e-6 * static_cast<double>(ns); }

/// "2026-01-31T12:00:00Z"; gmtime_r() allocates the first time alone.
std::array<char, 24> wall_time() noexcept {
  std::array<char, 24> text{};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::strftime(text.data(), text.size(), "%FT%TZ", &utc);
  return text;
}

void put(int descriptor, const char* text, int length) noexcept {
  if (length > 0) (void)!::write(descriptor, text, std::min(static_cast<std::size_t>(length), Text{}.size() - 1));
}

struct flock whole_file(short type) noexcept {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

GuardianReport::GuardianReport(const GuardianDeeds& deeds, const std::filesystem::path& file,
                               const std::string& command, int program)
    : deeds_(deeds),
      file_(file),
      command_(command),
      program_(program),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_ < 0) throw std::system_error(errno, std::generic_category(), "guardian: eventfd");
  (void)wall_time();
  thread_ = std::thread([this] { run(); });
}

GuardianReport::~GuardianReport() {
  tell();
  const MonotonicClock clock;
  for (const Stamp end = clock.now() + kPatience; !done_ && clock.now() < end;) {
    MonotonicClock sleeper;
    sleeper.sleep_until(clock.now() + kLook);
  }
  if (done_)
    thread_.join();
  else
    ::_exit(1);  // held up by the terminal or the disk: nobody can be told any more
  if (descriptor_ >= 0) ::close(descriptor_);
  ::close(wake_);
}

void GuardianReport::tell() noexcept {
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
}

void GuardianReport::run() noexcept {
  Stamp again{};
  bool began = false, confirmed = false;
  const MonotonicClock clock;
  while (true) {
    pollfd door{wake_, POLLIN, 0};
    (void)::poll(&door, 1, kAgain / std::chrono::milliseconds{1} / 4);
    std::uint64_t count = 0;
    (void)!::read(wake_, &count, sizeof count);
    const bool ended = deeds_.ended;
    const std::int64_t since = deeds_.taken_over_ns;
    const bool dark = deeds_.dark_ns != 0, rests = deeds_.rests_ns != 0, all = dark && rests;
    if (since != 0) {
      Text line;
      if (!began) {
        const int n = deeds_.gone ? std::snprintf(line.data(), line.size(),
                                                  "tankrig: guardian: takes over: process %d (%s) has ended, laser off "
                                                  "and arm at rest not confirmed\n",
                                                  program_, command_.c_str())
                                  : std::snprintf(line.data(), line.size(),
                                                  "tankrig: guardian: takes over: process %d (%s) made no safety step "
                                                  "for %.0f ms\n",
                                                  program_, command_.c_str(), ms(deeds_.stalled_ns));
        put(STDERR_FILENO, line.data(), n);
        again = clock.now() + kAgain / 2;
      }
      std::array<char, 128> state;
      std::snprintf(state.data(), state.size(), "%s%s%s", dark ? kLaserOff : kCutLaser, all ? ", " : "; ",
                    rests ? kArmAtRest : kCutArm);
      if (all && !confirmed) {
        const std::int64_t last = std::max(deeds_.dark_ns.load(), deeds_.rests_ns.load());
        put(STDERR_FILENO, line.data(),
            std::snprintf(line.data(), line.size(), "tankrig: guardian: confirmed after %.0f ms: %s\n",
                          ms(last - since), state.data()));
      } else if (ended && !all) {
        const bool emulated = deeds_.devices_ended && !deeds_.acknowledged;
        put(STDERR_FILENO, line.data(),
            std::snprintf(line.data(), line.size(), "tankrig: guardian: ends, not confirmed: %s%s\n",
                          emulated ? "the emulated devices have ended" : "an operator says that ",
                          emulated ? "" : kPowerIsCut));
      } else if (!all && clock.now() >= again) {
        put(STDERR_FILENO, line.data(),
            std::snprintf(line.data(), line.size(), "tankrig: guardian: still asking: %s\n", state.data()));
        again = clock.now() + kAgain;
      }
      if (!std::exchange(began, true) || confirmed != all || ended) write(state.data());
      confirmed = all;
    }
    if (ended) break;
  }
  done_ = true;
}

/// The whole file anew.
void GuardianReport::write(const char* state) noexcept {
  if (file_.empty()) return;
  if (descriptor_ < 0) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
    struct flock ours = whole_file(F_WRLCK);
    if (descriptor_ < 0 || ::fcntl(descriptor_, F_SETLK, &ours) != 0) return;
  }
  Text text;
  const auto after = [this](std::int64_t then, std::array<char, 40>& into) {
    if (then == 0)
      std::snprintf(into.data(), into.size(), "not confirmed");
    else
      std::snprintf(into.data(), into.size(), "confirmed after %.0f ms", ms(then - deeds_.taken_over_ns));
    return into.data();
  };
  std::array<char, 40> dark{}, rest{};
  const int n = std::snprintf(text.data(), text.size(),
                              "%s: took over from process %d (%s), which %s: %s; laser off %s; arm at rest %s%s\n",
                              wall_time().data(), program_, command_.c_str(), deeds_.gone ? "had ended" : "stood still",
                              state, after(deeds_.dark_ns, dark), after(deeds_.rests_ns, rest),
                              deeds_.acknowledged    ? "; an operator said that the power was cut"
                              : deeds_.devices_ended ? "; the emulated devices had ended"
                                                     : "");
  if (n <= 0 || ::ftruncate(descriptor_, 0) != 0) return;
  (void)!::pwrite(descriptor_, text.data(), std::min(static_cast<std::size_t>(n), text.size() - 1), 0);
  (void)::fdatasync(descriptor_);
}

std::optional<int> guardian_at_work(const std::filesystem::path& report) {
  const OwnedDescriptor file(::open(report.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct flock theirs = whole_file(F_WRLCK);
  if (!file || ::fcntl(file.get(), F_GETLK, &theirs) != 0 || theirs.l_type == F_UNLCK) return std::nullopt;
  return theirs.l_pid;
}

std::string take_guardian_report(const std::filesystem::path& report, const std::string& rig) {
  std::error_code none;
  if (report.empty() || !std::filesystem::is_regular_file(std::filesystem::symlink_status(report, none))) return {};
  std::string text = read_regular_file(report, kMostBytes, "a guardian's report");
  text = printable(text.substr(0, text.find('\n')));
  if (const auto process = guardian_at_work(report))
    throw InputError(report, fmt::format("the guardian, process {}, still makes safe: {}; once the power is cut: "
                                         "tankrig guardian --rig {} --acknowledge \"{}\"",
                                         *process, text, rig, kPowerIsCut));
  std::filesystem::rename(report, report.string() + ".shown", none);
  if (none) std::filesystem::remove(report, none);
  return text;
}

}  // namespace tankrig
