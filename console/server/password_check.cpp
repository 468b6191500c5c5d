#include "console/server/password_check.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <csignal>
#include <exception>
#include <memory>

namespace tankrig {
namespace {

constexpr int kNice = 10;
constexpr char kRight = 'y';

[[noreturn]] void answer(int to, const PasswordHash& hash, const std::string& password) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::dup2(to, 0) == 0) ::close_range(1, ~0U, 0);  // a command's terminal must end with the server
  errno = 0;
  (void)!::nice(kNice);
  try {
    const char said = matches(hash, password) ? kRight : 'n';
    (void)!::write(0, &said, 1);
  } catch (const std::exception&) {  // said nothing: no
  }
  ::_exit(0);
}

struct Answer {
  Answer(boost::asio::io_context& io, int descriptor, pid_t process) : pipe(io, descriptor), child(process) {}
  ~Answer() {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  boost::asio::posix::stream_descriptor pipe;
  pid_t child;
  std::array<char, 1> said{};
};

}  // namespace

void check_password(boost::asio::io_context& io, const PasswordHash& hash, const std::string& password,
                    std::function<void(bool)> done) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return done(false);
  const pid_t child = ::fork();
  if (child == 0) answer(ends[1], hash, password);
  ::close(ends[1]);
  if (child < 0) {
    ::close(ends[0]);
    return done(false);
  }
  const auto waited = std::make_shared<Answer>(io, ends[0], child);
  waited->pipe.async_read_some(boost::asio::buffer(waited->said),
                               [waited, done = std::move(done)](boost::system::error_code failure, std::size_t) {
                                 done(!failure && waited->said[0] == kRight);
                               });
}

}  // namespace tankrig
