#include "tests/kernel/realtime/load.hpp"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <regex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace tankrig::test {

namespace {

/// `command`, once its program and libraries have been read: a processor that waits for the host's disk is idle.
std::vector<std::string> once_read(std::vector<std::string> command) {
  (void)shell("cat $(ldd $(command -v " + command.front() + ") | grep -o '/[^ ]*') $(command -v " + command.front() +
              ") > /dev/null");
  return command;
}

}  // namespace

Load::Load() : stress_(once_read({"stress-ng", "--quiet", "--cpu", "2", "--vm", "1", "--sock", "1"})) {
  for (int seconds = 0; seconds < 60; ++seconds) {
    const double idle = processor_idle();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    if (processor_idle() - idle < 0.02) return;
  }
  throw std::runtime_error("stress-ng: the processor is still idle after a minute");
}

Load::~Load() {
  stress_.kill(SIGTERM);
  stress_.wait();
}

double processor_idle() {
  std::ifstream file("/proc/stat");
  std::string cpu;
  double user = 0, nice = 0, system = 0, idle = 0, waiting = 0;
  if (!(file >> cpu >> user >> nice >> system >> idle >> waiting)) throw std::runtime_error("no /proc/stat");
  return (idle + waiting) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

Duration loaded_cyclictest(int priority, std::uint64_t cycles) {
  const Load load;
  const std::string out =
      shell("cyclictest -q -m -p " + std::to_string(priority) + " -i 1000 -l " + std::to_string(cycles));
  std::smatch match;
  if (!std::regex_search(out, match, std::regex("Min: *(\\d+).*Avg: *(\\d+).*Max: *(\\d+)")))
    throw std::runtime_error("cyclictest said: " + out);
  std::printf("cyclictest %s cycles: wake-up min %s, mean %s, max %s us\n", std::to_string(cycles).c_str(),
              match.str(1).c_str(), match.str(2).c_str(), match.str(3).c_str());
  return std::chrono::microseconds(std::stol(match.str(3)));
}

}  // namespace tankrig::test
