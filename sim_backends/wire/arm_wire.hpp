// One wire of the emulated arm: a thread that waits for bytes, for the end of an answer, or for the end.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <random>
#include <thread>

#include "core/clock.hpp"
#include "drivers/can/can_bus.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "sim_backends/wire/arm_electronics.hpp"
#include "sim_backends/wire/pty.hpp"

namespace tankrig::sim {

/// Threads: start(), wake() and destruction the owner's; the rest its own.
class ArmWire {
 public:
  ArmWire(ArmElectronics& electronics, const ArmEmulatorParameters& parameters, const Clock& clock);
  virtual ~ArmWire() = default;

  void start();
  /// Ends the thread; every derived destructor calls it first.
  void end();
  /// The serial line's plug.
  void set_plugged(bool plugged);

 protected:
  /// Reads what has come and writes what is due; returns the latest time of the next call.
  virtual Stamp attend(Stamp now) = 0;
  /// Readable when something has come; -1 if there is nothing to wait for.
  virtual int descriptor() const = 0;

  static constexpr Duration kIdle = std::chrono::milliseconds(50);

  ArmElectronics& electronics_;
  const ArmEmulatorParameters& parameters_;
  const Clock& clock_;
  std::mt19937_64 random_;
  std::atomic<bool> plugged_{true};

 private:
  void run();

  OwnedDescriptor wake_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

std::unique_ptr<ArmWire> make_can_wire(std::unique_ptr<CanBus> bus, ArmElectronics& electronics,
                                       const ArmEmulatorParameters& parameters, const Clock& clock);
std::unique_ptr<ArmWire> make_serial_wire(const std::filesystem::path& line, ArmElectronics& electronics,
                                          const ArmEmulatorParameters& parameters, const Clock& clock);

}  // namespace tankrig::sim
