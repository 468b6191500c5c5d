#include "tests/kernel/guest.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace tankrig::test {

std::string shell(const std::string& command) {
  FILE* pipe = ::popen(("exec 2>&1; " + command).c_str(), "r");
  if (!pipe) throw std::runtime_error("cannot run: " + command);
  std::string output;
  char part[4096];
  for (std::size_t n; (n = std::fread(part, 1, sizeof part, pipe)) > 0;) output.append(part, n);
  if (const int status = ::pclose(pipe); status != 0)
    throw std::runtime_error(command + ": status " + std::to_string(status) + ": " + output);
  return output;
}

Background::Background(const std::vector<std::string>& command, const std::string& output) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  if (!output.empty())
    ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int error = ::posix_spawnp(&pid_, arguments[0], &files, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  if (error) throw std::runtime_error("cannot run " + command[0]);
}

Background::~Background() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Background::kill(int signal) noexcept {
  if (pid_ > 0) ::kill(pid_, signal);
}

int Background::wait() noexcept {
  int status = 0;
  if (pid_ <= 0 || !becomes_true([&] { return ::waitpid(pid_, &status, WNOHANG) == pid_; }, std::chrono::seconds(10)))
    return -1;
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool becomes_true(const std::function<bool()>& condition, Duration limit) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

void set_link(const std::string& interface, const std::string& what) { shell("ip link set " + interface + " " + what); }

void set_fault(const std::string& interface, std::string_view fault) {
  std::ofstream file("/sys/class/net/" + interface + "/fault");
  file << fault << std::flush;
  if (!file) throw std::runtime_error(interface + ": no fault '" + std::string(fault) + "'");
}

bool has_listener(const std::string& interface) {
  std::ifstream lists("/proc/net/can/rcvlist_all");
  for (std::string line; std::getline(lists, line);) {
    std::istringstream words(line);
    std::string device, id;
    if (words >> device >> id && device == interface && id == "000") return true;
  }
  return false;
}

CanFrame frame_of(std::uint16_t id, const std::vector<std::uint8_t>& data) {
  CanFrame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

bool send_within(CanBus& bus, const CanFrame& frame, Duration limit) {
  return becomes_true([&] { return bus.try_send(frame).ok(); }, limit);
}

std::optional<CanFrame> receive_within(CanBus& bus, Duration limit) {
  std::optional<CanFrame> frame;
  becomes_true(
      [&] {
        const auto received = bus.try_receive();
        if (received.ok()) frame = received.value();
        return frame.has_value();
      },
      limit);
  return frame;
}

bool reaches(CanBus& bus, CanState state, Duration limit) {
  return becomes_true(
      [&] {
        while (true) {
          const auto received = bus.try_receive();
          if (!received.ok()) (void)bus.reopen();
          if (!received.ok() || !received.value()) break;
        }
        return bus.state() == state;
      },
      limit);
}

}  // namespace tankrig::test
