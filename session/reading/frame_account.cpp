#include "session/reading/frame_account.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tankrig {
namespace {

constexpr const char* kRecorded = "recorded";
constexpr const char* kNotRecorded = "not_recorded";

std::uint64_t count_of(const FrameCounts& counts, const std::string& camera, const char* what) {
  const auto found = counts.find(camera + "." + what);
  return found == counts.end() ? 0 : found->second;
}

}  // namespace

std::vector<std::pair<std::string, std::uint64_t>> frame_reasons(const FrameCounts& counts, const std::string& camera) {
  std::vector<std::pair<std::string, std::uint64_t>> reasons;
  for (const auto& [name, count] : counts) {
    if (count == 0 || !name.starts_with(camera + ".")) continue;
    const std::string reason = name.substr(camera.size() + 1);
    if (reason != kRecorded && reason.find('.') == std::string::npos) reasons.emplace_back(reason, count);
  }
  return reasons;
}

std::int64_t unaccounted(const FrameCounts& counts, const std::string& camera, std::uint64_t expected) {
  std::uint64_t known = count_of(counts, camera, kRecorded);
  for (const auto& [reason, count] : frame_reasons(counts, camera)) known += count;
  const std::uint64_t apart = expected > known ? expected - known : known - expected;
  const auto bounded = static_cast<std::int64_t>(std::min(apart, std::uint64_t{INT64_MAX}));
  return expected > known ? bounded : -bounded;
}

bool lost_nothing(const FrameCounts& counts, const std::string& camera, const CameraAccount& account) {
  for (const auto& [reason, count] : frame_reasons(counts, camera))
    if (reason != kNotRecorded) return false;
  return account.closes();
}

std::string account_line(const FrameCounts& counts, const std::string& camera, const CameraAccount& account) {
  const std::uint64_t wanted = account.expected - std::min(account.expected, count_of(counts, camera, kNotRecorded));
  std::string line = fmt::format("{} of {} frames recorded", count_of(counts, camera, kRecorded), wanted);
  const char* before = ": ";
  for (const auto& [reason, count] : frame_reasons(counts, camera))
    if (reason != kNotRecorded) line += fmt::format("{}{} {}", std::exchange(before, ", "), reason, count);
  if (account.unaccounted > 0) line += fmt::format("{}unaccounted {}", before, account.unaccounted);
  if (account.unaccounted < 0) line += fmt::format("{}counted twice {}", before, -account.unaccounted);
  return line;
}

}  // namespace tankrig
