#include "drivers/arm/arm_zero.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/config_node.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw InputError(file, std::string(what) + ": " + std::strerror(errno));
}

}  // namespace

ArmZero load_arm_zero(const std::filesystem::path& file) {
  const ConfigNode node = ConfigNode::load(file);
  ArmZero zero;
  zero.taken = node.text("taken");
  const ConfigNode raw = node.child("raw_ticks_at_zero");
  for (std::size_t j = 0; j < kJoints; ++j)
    zero.raw[j] = static_cast<std::uint16_t>(raw.integer(kJointNames[j], {0, 65535}));
  node.finish();
  return zero;
}

void save_arm_zero(const std::filesystem::path& file, const ArmZero& zero) {
  std::string text =
      "# Raw encoder readings at the actuators' tick 0. Void as soon as the arm has been without supply: home again.\n"
      "taken: \"" +
      zero.taken + "\"\nraw_ticks_at_zero:\n";
  for (std::size_t j = 0; j < kJoints; ++j)
    text += std::string("  ") + kJointNames[j] + ": " + std::to_string(zero.raw[j]) + "\n";
  std::string beside = file.string() + ".XXXXXX";
  const int fd = ::mkostemp(beside.data(), O_CLOEXEC);
  if (fd < 0) fail(file, "cannot write");
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       ::fchmod(fd, 0644) == 0 && ::fsync(fd) == 0;
  ::close(fd);
  if (written && ::rename(beside.c_str(), file.c_str()) == 0) return;
  const int error = errno;
  ::unlink(beside.c_str());
  errno = error;
  fail(file, "cannot write");
}

}  // namespace tankrig
