#include "bench/external/task_group.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <system_error>

namespace tankrig {

TaskGroup::TaskGroup(int most) {
  for (const std::filesystem::path mount : {"/sys/fs/cgroup/pids", "/sys/fs/cgroup"}) {
    std::error_code error;
    path_ = mount / ("tankrig-" + std::to_string(::getpid()));
    if (!std::filesystem::exists(mount / "cgroup.procs", error) || !std::filesystem::create_directory(path_, error))
      continue;
    std::ofstream limit(path_ / "pids.max");
    limit << most << std::flush;
    if (limit.good()) processes_ = ::open((path_ / "cgroup.procs").c_str(), O_WRONLY | O_CLOEXEC);
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

}  // namespace tankrig
