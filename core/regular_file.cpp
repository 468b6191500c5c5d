#include "core/regular_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

[[noreturn]] void refuse(int descriptor, const std::filesystem::path& file, const std::string& why,
                         const std::string& expected) {
  if (descriptor >= 0) ::close(descriptor);
  throw InputError(file, why + ", expected " + expected);
}

[[noreturn]] void refuse_size(int descriptor, const std::filesystem::path& file, std::uint64_t most,
                              const std::string& expected) {
  refuse(descriptor, file, fmt::format("holds more than {} MiB", most >> 20), expected + " of at most that");
}

int checked(int descriptor, const std::filesystem::path& file, std::uint64_t most, const std::string& expected) {
  struct stat status {};
  if (descriptor < 0 || ::fstat(descriptor, &status) != 0) refuse(descriptor, file, "cannot be read", expected);
  if (S_ISDIR(status.st_mode)) refuse(descriptor, file, "is a folder", expected);
  if (!S_ISREG(status.st_mode)) refuse(descriptor, file, "is a pipe, a socket or a device", expected);
  if (static_cast<std::uint64_t>(status.st_size) > most) refuse_size(descriptor, file, most, expected);
  return descriptor;
}

}  // namespace

const int kReadWithoutWaiting = O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;

std::uint64_t most_table_bytes() {
  const auto memory =
      static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::getpagesize());
  return std::max(memory / 2, std::uint64_t{2} << 30);
}

int open_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected) {
  return checked(::open(file.c_str(), kReadWithoutWaiting), file, most, expected);
}

std::string read_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected) {
  return read_regular_file(::open(file.c_str(), kReadWithoutWaiting), file, most, expected);
}

std::string read_regular_file(int descriptor, const std::filesystem::path& file, std::uint64_t most,
                              const std::string& expected) {
  checked(descriptor, file, most, expected);
  std::string text;
  std::array<char, 1 << 16> part;
  while (const ssize_t got = ::read(descriptor, part.data(), part.size())) {
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) refuse(descriptor, file, std::string("cannot be read to its end: ") + std::strerror(errno), expected);
    text.append(part.data(), static_cast<std::size_t>(got));
    if (text.size() > most) refuse_size(descriptor, file, most, expected);  // it grows
  }
  ::close(descriptor);
  return text;
}

}  // namespace tankrig
