// A camera's controls by their v4l2-ctl names, and its automatics switched off for measuring.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/v4l2_device.hpp"
#include "drivers/camera/v4l2_settings.hpp"

namespace tankrig {

struct V4l2ControlInfo {
  std::uint32_t id = 0;
  std::string name;  ///< lower case, words joined by '_': "Exposure, Auto" is exposure_auto
  std::uint32_t type = 0, flags = 0;
  std::int32_t minimum = 0, maximum = 0;
};

/// The controls of one open device.
/// Threads: one.
/// RT: never.
class V4l2Controls {
 public:
  explicit V4l2Controls(V4l2Device& device);

  const std::vector<V4l2ControlInfo>& all() const { return all_; }
  /// By name or by id ("0x00980913", "9963795"). Names that kernel 5.17 changed are known in both forms.
  const V4l2ControlInfo* find(const std::string& name_or_id) const;

  /// Returns the value that the device then has.
  /// Errors: InputError, naming the controls it has or the range it accepts.
  std::int32_t set(const std::string& name_or_id, std::int32_t value);
  std::optional<std::int32_t> get(std::uint32_t id) const;

  /// Sets exposure, gain, white balance, focus, hue and brightness to manual and fixes the frame rate, as far as the
  /// device has them, except those in `but`. Returns what was set; adds to `stubborn` a line for each that failed.
  std::vector<V4l2Control> switch_automatics_off(const std::vector<V4l2Control>& but,
                                                 std::vector<std::string>& stubborn);

 private:
  V4l2Device& device_;
  std::vector<V4l2ControlInfo> all_;
};

}  // namespace tankrig
