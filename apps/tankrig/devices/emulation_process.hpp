// The emulated devices of a rig in a process of their own, as real devices are: `tankrig emulate`, started and ended
// here.
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "apps/tankrig/devices/backend.hpp"

namespace tankrig::app {

/// Names the runtime folder of devices that are being emulated already.
inline constexpr char kRuntimeVariable[] = "TANKRIG_RUNTIME";

/// A fresh folder for the lines and buses of emulated devices; removed with all it holds, or after a kill by the next
/// one that is made. A lock says that its owner, or whoever it started, lives.
class RuntimeFolder {
 public:
  RuntimeFolder();
  ~RuntimeFolder();
  RuntimeFolder(const RuntimeFolder&) = delete;
  RuntimeFolder& operator=(const RuntimeFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

/// Runs from construction, when every device answers, to destruction. It ignores the terminal's Ctrl-C, so that a scan
/// can still stop its arm, and dies with this process.
class EmulationProcess {
 public:
  /// Errors: InputError if the devices cannot be emulated here; the process has said why on stderr.
  EmulationProcess(const RigConfig& rig, const BackendOptions& options);
  ~EmulationProcess() { end(); }
  EmulationProcess(const EmulationProcess&) = delete;
  EmulationProcess& operator=(const EmulationProcess&) = delete;

  const std::filesystem::path& runtime() const { return runtime_.path(); }

 private:
  void end() noexcept;

  RuntimeFolder runtime_;
  pid_t process_ = -1;
};

}  // namespace tankrig::app
