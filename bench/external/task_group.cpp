#include "bench/external/task_group.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <string>
#include <string_view>
#include <system_error>

namespace tankrig {

TaskGroup::TaskGroup(int most) {
  for (const std::filesystem::path mount : {"/sys/fs/cgroup/pids", "/sys/fs/cgroup"}) {
    std::error_code error;
    path_ = mount / ("tankrig-" + std::to_string(::getpid()));
    if (!std::filesystem::exists(mount / "cgroup.procs", error) || !std::filesystem::create_directory(path_, error))
      continue;
    const std::string number = std::to_string(most);
    const int limit = ::open((path_ / "pids.max").c_str(), O_WRONLY | O_CLOEXEC);
    const bool set = limit >= 0 && ::write(limit, number.data(), number.size()) > 0;
    if (limit >= 0) ::close(limit);
    if (set) processes_ = ::open((path_ / "cgroup.procs").c_str(), O_WRONLY | O_CLOEXEC);
    if (processes_ >= 0) return;
    ::rmdir(path_.c_str());
  }
}

TaskGroup::~TaskGroup() {
  if (processes_ < 0) return;
  ::close(processes_);
  ::rmdir(path_.c_str());
}

void TaskGroup::enter() const noexcept {
  if (processes_ >= 0) (void)!::write(processes_, "0", 1);
}

bool TaskGroup::refused_some() const noexcept {
  if (processes_ < 0) return false;
  const int events = ::open((path_ / "pids.events").c_str(), O_RDONLY | O_CLOEXEC);
  std::array<char, 64> text{};  // "max 3"
  const ssize_t length = events >= 0 ? ::read(events, text.data(), text.size() - 1) : -1;
  if (events >= 0) ::close(events);
  return length > 0 && std::string_view(text.data()).find("max 0") == std::string_view::npos;
}

}  // namespace tankrig
