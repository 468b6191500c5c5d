#include "console/server/captured_program.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>

#include "core/input_error.hpp"

extern char** environ;

namespace tankrig {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMostBytes = 64 << 20;

/// Lives until both pipes have ended.
class Capture : public std::enable_shared_from_this<Capture> {
 public:
  Capture(asio::io_context& io, pid_t process, int out, int err, std::function<void(Captured)> done,
          std::chrono::seconds longest)
      : out_(io, out), err_(io, err), late_(io, longest), process_(process), done_(std::move(done)) {}

  void begin() {
    read(out_, result_.out, out_buffer_);
    read(err_, result_.err, err_buffer_);
    late_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) ::kill(self->process_, SIGTERM);
    });
  }

 private:
  using Buffer = std::array<char, 16 << 10>;
  void read(asio::posix::stream_descriptor& from, std::string& to, Buffer& buffer) {
    from.async_read_some(asio::buffer(buffer),
                         [this, &from, &to, &buffer, self = shared_from_this()](error_code failure, std::size_t n) {
                           to.append(buffer.data(), n);
                           if (to.size() > kMostBytes) ::kill(process_, SIGTERM);
                           if (!failure && to.size() <= 2 * kMostBytes) return read(from, to, buffer);
                           if (++ended_ == 2) end();
                         });
  }
  void end() {
    late_.cancel();
    int status = 0;
    ::waitpid(process_, &status, 0);
    result_.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    done_(std::move(result_));
  }

  asio::posix::stream_descriptor out_, err_;
  asio::steady_timer late_;
  const pid_t process_;
  std::function<void(Captured)> done_;
  Buffer out_buffer_{}, err_buffer_{};
  Captured result_;
  int ended_ = 0;
};

}  // namespace

std::string last_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

void capture(asio::io_context& io, const std::vector<std::string>& command, std::function<void(Captured)> done,
             std::chrono::seconds longest) {
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  int out[2], err[2];
  if (::pipe2(out, O_CLOEXEC) != 0) throw InputError(std::string("console: pipe: ") + std::strerror(errno));
  if (::pipe2(err, O_CLOEXEC) != 0) {
    for (const int end : out) ::close(end);
    throw InputError(std::string("console: pipe: ") + std::strerror(errno));
  }
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  pid_t process = -1;
  const int failure = ::posix_spawn(&process, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(out[1]);
  ::close(err[1]);
  if (failure != 0) {
    ::close(out[0]);
    ::close(err[0]);
    throw InputError("console: " + command[0] + ": " + std::strerror(failure) + ", expected to start it");
  }
  std::make_shared<Capture>(io, process, out[0], err[0], std::move(done), longest)->begin();
}

}  // namespace tankrig
