#include "drivers/arm/zero_proof.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "core/input_error.hpp"
#include "core/utc.hpp"

namespace tankrig {
namespace {

/// The lock that whoever moves the arm holds; none if there is no such file and it is not to be made.
OwnedDescriptor lock(const std::filesystem::path& zero_file, int kind, bool make) {
  const std::string name = zero_file.string() + ".lock";
  OwnedDescriptor fd(::open(name.c_str(), O_RDONLY | O_CLOEXEC | (make ? O_CREAT : 0), 0666));
  if (fd ? ::flock(fd.get(), kind | LOCK_NB) == 0 : !make) return fd;
  if (errno == EWOULDBLOCK) throw InputError(zero_file, "another program is moving the arm; wait for it to end");
  throw InputError(zero_file, std::string("cannot be locked: ") + std::strerror(errno));
}

}  // namespace

void check_nobody_moves(const std::filesystem::path& zero_file) {
  if (!zero_file.empty()) (void)lock(zero_file, LOCK_SH, false);
}

ZeroProof::ZeroProof(std::filesystem::path file, JointSet driven) : file_(std::move(file)), driven_(driven) {
  check_nobody_moves(file_);
  if (!std::filesystem::exists(file_)) return;
  zero_ = load_arm_zero(file_);
  doubt_ = !zero_->voided.empty() ? Doubt::kVoided : zero_->exit ? Doubt::kUndecided : Doubt::kNoExit;
}

bool ZeroProof::judge(const std::array<std::uint16_t, kJoints>& raw) noexcept {
  doubt_ = Doubt::kNone;
  for (std::size_t j = 0; j < kJoints && doubt_ == Doubt::kNone; ++j) {
    const int off = static_cast<std::int16_t>(static_cast<std::uint16_t>(raw[j] - zero_->exit->raw[j]));
    if (holds(driven_, j) && near_power_up(raw[j]))
      doubt_ = Doubt::kPowerUp;
    else if (std::abs(off) > kSettled)
      doubt_ = Doubt::kElsewhere;
    joint_ = j;
    read_ = raw[j];
  }
  return doubt_ == Doubt::kNone;
}

std::string ZeroProof::why_not() const {
  switch (doubt_) {
    case Doubt::kNone:
      return {};
    case Doubt::kUndecided:
      return "its encoders have not been read yet";
    case Doubt::kNoFile:
      return "there is no zero file " + file_.string();
    case Doubt::kVoided:
      return "its zero of " + zero_->taken + " is no longer valid: " + zero_->voided;
    case Doubt::kNoExit:
      return "the program that moved it last left no record of an orderly end in " + file_.string();
    case Doubt::kElsewhere:
      return fmt::format("{} reads {}, but {} where it was left at {}: it lost power, or somebody else moved it",
                         kJointNames[joint_], read_, zero_->exit->raw[joint_], zero_->exit->at);
    case Doubt::kPowerUp:
      return fmt::format("{} reads {}, as after power-up; it was left at {}", kJointNames[joint_], read_,
                         zero_->exit->at);
  }
  return "its zero is in doubt";
}

void ZeroProof::begin_motion() {
  lock_ = lock(file_, LOCK_EX, true);
  if (!zero_) return;
  const bool believed = doubt_ == Doubt::kNone || doubt_ == Doubt::kUndecided;
  if (believed && (!std::filesystem::exists(file_) || load_arm_zero(file_) != *zero_)) {
    lock_.reset();
    throw InputError(file_, "changed since this command started: run it again");
  }
  ArmZero unproven = *zero_;
  unproven.exit.reset();
  save_arm_zero(file_, unproven);
}

void ZeroProof::replace(const ArmZero& zero) {
  zero_ = zero;
  doubt_ = Doubt::kNone;
}

void ZeroProof::void_it(const std::string& why) {
  if (!zero_ || doubt_ == Doubt::kVoided) return;
  const ArmZero loaded = *zero_;
  zero_->voided = why + ", noticed at " + utc_now();
  zero_->exit.reset();
  doubt_ = Doubt::kVoided;
  OwnedDescriptor mine;
  if (!lock_) {
    mine = lock(file_, LOCK_EX, true);
    if (!std::filesystem::exists(file_) || load_arm_zero(file_) != loaded) return;
  }
  save_arm_zero(file_, *zero_);
}

void ZeroProof::end_motion(const std::optional<std::array<std::uint16_t, kJoints>>& at_rest) {
  if (doubt_ == Doubt::kNone && zero_ && at_rest) {
    zero_->exit = {*at_rest, utc_now()};
    save_arm_zero(file_, *zero_);
  }
  lock_.reset();
}

}  // namespace tankrig
