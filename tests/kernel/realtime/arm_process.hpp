// The emulated arm in a process of its own, as `tankrig emulate` has it, at the other end of a CAN interface.
#pragma once

#include <sys/types.h>

#include <string>

#include "core/arm_model.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "sim_backends/wire/arm_emulator_parameters.hpp"

namespace tankrig::test {

/// To be made before the first thread is. Ends with the scope.
class ArmProcess {
 public:
  /// Answers on `interface`.
  /// Errors: std::runtime_error.
  ArmProcess(const std::string& interface, const sim::ArmEmulatorParameters& parameters);
  ~ArmProcess();
  ArmProcess(const ArmProcess&) = delete;
  ArmProcess& operator=(const ArmProcess&) = delete;

  /// Where its links really are.
  JointVector truth() const;
  /// What homing would find.
  const std::array<std::uint16_t, kJoints>& true_zero() const { return true_zero_; }

 private:
  [[noreturn]] static void serve(int end, const std::string& interface, const sim::ArmEmulatorParameters& parameters);

  OwnedDescriptor line_;
  pid_t pid_ = -1;
  std::array<std::uint16_t, kJoints> true_zero_{};
};

}  // namespace tankrig::test
