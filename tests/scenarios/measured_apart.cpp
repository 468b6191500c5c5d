#include "tests/scenarios/measured_apart.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <sstream>

namespace tankrig::scenarios {
namespace {

constexpr char kEnd = '\0';  // of each part

void write_all(int to, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(to, text.data() + done, text.size() - done);
    if (n <= 0) return;
    done += static_cast<std::size_t>(n);
  }
}

std::string read_all(int from) {
  std::string text;
  char buffer[4096];
  for (ssize_t n = 0; (n = ::read(from, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
  return text;
}

[[noreturn]] void measure_and_tell(const std::function<Measured()>& measure, int to) {
  Measured m;
  try {
    m = measure();
  } catch (const std::exception& e) {
    m.why = e.what();
  }
  write_all(to, m.line + kEnd + m.status + kEnd + m.why + kEnd + m.skipped + kEnd);
  std::fflush(stdout);
  ::_exit(0);
}

}  // namespace

Measured measured_apart(const std::function<Measured()>& measure, unsigned longest_s, std::mutex& alone) {
  std::unique_lock forking(alone);  // another child would keep this pipe's end open
  int pipe[2];
  if (::pipe2(pipe, O_CLOEXEC) != 0) return {"", "", std::string("pipe: ") + std::strerror(errno), ""};
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    ::alarm(longest_s);
    measure_and_tell(measure, pipe[1]);
  }
  ::close(pipe[1]);
  forking.unlock();
  const std::string told = child < 0 ? "" : read_all(pipe[0]);
  ::close(pipe[0]);
  if (child < 0) return {"", "", std::string("fork: ") + std::strerror(errno), ""};
  int status = 0;
  ::waitpid(child, &status, 0);
  if (std::ranges::count(told, kEnd) != 4)
    return {"", "", WIFSIGNALED(status) ? std::string("died: ") + ::strsignal(WTERMSIG(status)) : "told nothing", ""};
  Measured m;
  std::istringstream parts(told);
  for (std::string* part : {&m.line, &m.status, &m.why, &m.skipped}) std::getline(parts, *part, kEnd);
  return m;
}

}  // namespace tankrig::scenarios
