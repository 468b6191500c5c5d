#include "apps/tankrig/command_line/progress.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/feed.hpp"
#include "core/shown_text.hpp"

namespace tankrig::app {
namespace {

void tell(const char* level, const std::string& text) {
  if (Feed::one().heard()) Feed::one().tell({{"feed", "told"}, {"level", level}, {"text", text}});
}

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) != 0) {
  if (!spdlog::get("tankrig")) spdlog::set_default_logger(spdlog::stderr_color_mt("tankrig"));
  spdlog::set_pattern("tankrig: %^%l%$: %v");
}

Progress::~Progress() { finish_line(); }

void Progress::finish_line() {
  const std::lock_guard lock(mutex_);
  end_stage();
}

void Progress::end_stage() {
  end_line();
  if (!terminal_ && !detail_.empty()) std::fprintf(stderr, "%s: %s\n", stage_.c_str(), detail_.c_str());
  detail_.clear();
}

void Progress::end_line() {
  if (line_open_) std::fputc('\n', stderr);
  line_open_ = false;
}

void Progress::update(const std::string& stage, double fraction, const std::string& detail) {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const bool new_stage = stage != stage_;
  if (Feed::one().heard() && (new_stage || fraction >= 1 || now - fed_ >= std::chrono::milliseconds(100))) {
    fed_ = now;
    Feed::one().tell_newest({{"feed", "progress"}, {"stage", stage}, {"fraction", fraction}, {"detail", detail}});
  }
  if (!terminal_) {
    if (new_stage) end_stage(), std::fprintf(stderr, "%s\n", stage.c_str());
    stage_ = stage;
    detail_ = detail;
    return;
  }
  if (!new_stage && fraction < 1 && now - last_ < std::chrono::milliseconds(50)) return;
  if (new_stage) end_line();
  const double percent = 100 * std::clamp(fraction, 0.0, 1.0);
  line_open_ = true;
  stage_ = stage;
  last_ = now;
  if (!detail.empty()) {
    std::fprintf(stderr, "\r%s  %3.0f %%  %s\033[K", stage.c_str(), percent, detail.c_str());
    std::fflush(stderr);
    return;
  }
  constexpr int kWidth = 32;
  const int filled = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
  std::fprintf(stderr, "\r%-34s [%s%s] %3.0f %%", stage.c_str(), std::string(filled, '#').c_str(),
               std::string(kWidth - filled, ' ').c_str(), percent);
  std::fflush(stderr);
}

void Progress::note(const std::string& text) {
  const std::lock_guard lock(mutex_);
  end_line();
  spdlog::info("{}", printable(text));
  tell("note", text);
}

void Progress::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  end_line();
  spdlog::warn("{}", printable(text));
  tell("warning", text);
}

}  // namespace tankrig::app
