// What the guardian did, told on the terminal and in a file that the next command shows.
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "core/clock.hpp"
#include "rig/safety/cry_for_help.hpp"

namespace tankrig {

/// A takeover as it goes on. Zero: not yet.
struct GuardianDeeds {
  std::atomic<std::int64_t> taken_over_ns{0}, stalled_ns{0}, dark_ns{0}, rests_ns{0};
  std::atomic<bool> gone{false};  ///< it was the program's death, not its standing still
  std::atomic<bool> acknowledged{false};
  std::atomic<bool> devices_ended{false};  ///< the emulated ones, with the program
  std::atomic<bool> ended{false};
};

/// Tells of the deeds from a thread of its own, which may be held up by the terminal or the disk: when the guardian
/// takes over, when something is confirmed, and every kAgain while something is not. The file is locked until its
/// destruction. Allocates nothing once constructed.
/// Threads: one constructs and destroys it; tell() any.
class GuardianReport {
 public:
  static constexpr Duration kAgain = CryForHelp::kAgain;

  /// `deeds` outlive it. `program`: the process that is guarded.
  GuardianReport(const GuardianDeeds& deeds, const std::filesystem::path& file, const std::string& command,
                 int program);
  /// Waits a second at most for what is still to be told.
  ~GuardianReport();
  GuardianReport(const GuardianReport&) = delete;
  GuardianReport& operator=(const GuardianReport&) = delete;

  /// Something has changed.
  void tell() noexcept;

 private:
  void run() noexcept;
  void write(const char* state) noexcept;

  const GuardianDeeds& deeds_;
  const std::filesystem::path file_;
  const std::string command_;
  const int program_;
  int wake_ = -1, descriptor_ = -1;
  std::atomic<bool> done_{false};
  std::thread thread_;
};

/// The process that holds the lock of `report`: a guardian that still makes safe; nothing if none does.
std::optional<int> guardian_at_work(const std::filesystem::path& report);

/// What a guardian left there, and puts it away: it is renamed to "FILE.shown". Empty if there is none.
/// Errors: InputError while that guardian still makes safe, with what to do.
std::string take_guardian_report(const std::filesystem::path& report, const std::string& rig);

}  // namespace tankrig
