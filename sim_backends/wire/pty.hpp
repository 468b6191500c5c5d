// An emulated serial line: a pseudo-terminal whose other end a driver opens by a name of our choice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "core/result.hpp"

namespace tankrig::sim {

/// The device's end, raw and non-blocking. The driver's end is a symbolic link at `name`, made here and removed by the
/// destructor.
/// Threads: one.
class Pty {
 public:
  /// Errors: InputError if the system has no pseudo-terminals or the link cannot be made. A stale link is replaced.
  explicit Pty(std::filesystem::path name);
  ~Pty();
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  /// Bytes read, 0 if none wait (also while nobody has the other end open).
  Result<std::size_t> try_read(std::span<std::uint8_t> into) noexcept;
  Result<std::size_t> try_write(std::span<const std::uint8_t> bytes) noexcept;

  /// Unplugs: the driver sees a hang-up, and the name is gone.
  void unplug() noexcept;
  /// Plugs in again, under the same name.
  void plug();

  /// For poll; -1 while unplugged.
  int descriptor() const noexcept { return master_; }
  const std::filesystem::path& name() const noexcept { return name_; }

 private:
  std::filesystem::path name_;
  int master_ = -1;
  int keeper_ = -1;  ///< our own hold on the driver's end, so that its closing is no hang-up for us
};

}  // namespace tankrig::sim
