#include "session/checking/examination.hpp"

#include <fmt/core.h>

namespace tankrig {

namespace fs = std::filesystem;

void Examination::lose(const fs::path& file, const std::string& what) {
  told.insert(file.generic_string());
  losses.push_back(file.generic_string() + ": " + what);
}

std::string Examination::span_text(Stamp from, Stamp to) const {
  return fmt::format("from {} to {}", seconds_text(from - zero()), seconds_text(to - zero()));
}

Stamp Examination::zero() const {
  if (const auto span = info.tables.find("joints"); span != info.tables.end()) return span->second.first;
  if (!joints.records.empty()) return joints.records.front().stamp;
  return frames.records.empty() ? Stamp{} : frames.records.front().stamp;
}

std::string plural(std::size_t n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string seconds_text(Duration time) { return fmt::format("{:.3f} s", seconds(time)); }

std::string within(const fs::path& session, const std::string& message) {
  const std::string before = (session / "").string();
  return message.starts_with(before) ? message.substr(before.size()) : message;
}

}  // namespace tankrig
