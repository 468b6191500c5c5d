// A Video for Linux camera's settings in the rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "core/time.hpp"
#include "drivers/camera/pixel_format.hpp"

namespace tankrig {

/// What is done with the two fields of an interlaced camera. Delivered pictures always have the full height.
enum class FieldUse : std::uint8_t {
  kWeave,   ///< one picture of both; rows alternate between two instants a field period apart
  kFirst,   ///< the older field alone
  kSecond,  ///< the newer field alone
  kBoth,    ///< each field a picture of its own, twice the frame rate
};
template <>
inline constexpr std::array kNames<FieldUse>{"weave", "first", "second", "both"};

/// Which clock a buffer's stamp is on.
enum class StampClock : std::uint8_t {
  kDeclared,   ///< as the driver's flags say; if they say nothing, the time of arrival
  kMonotonic,  ///< CLOCK_MONOTONIC, though the driver does not declare it
  kArrival,    ///< never the driver's: the time of arrival
};
template <>
inline constexpr std::array kNames<StampClock>{"declared", "monotonic", "arrival"};

/// Which moment of the frame a buffer's stamp is.
enum class StampPoint : std::uint8_t { kDeclared, kEnd, kStart };
template <>
inline constexpr std::array kNames<StampPoint>{"declared", "end", "start"};

struct V4l2Control {
  std::string name;  ///< as v4l2-ctl writes it, or an id, e.g. 0x009a0902
  std::int32_t value = 0;
};

struct V4l2CameraSettings {
  std::string name = "camera";
  std::string device = "/dev/video0";  ///< or, to find it again on any port, /dev/v4l/by-id/...
  int width = 0, height = 0;           ///< [px]; 0: as the device stands
  int channels = 3;                    ///< of the delivered pictures, 1 or 3 (BGR)
  double rate_hz = 0;                  ///< frames, not fields; 0: as the device stands
  std::vector<PixelFormat> formats;    ///< in order of preference; empty: preferred_formats(channels)
  std::string field_order =
      "any";  ///< any none interlaced interlaced-tb interlaced-bt seq-tb seq-bt alternate top bottom
  FieldUse fields = FieldUse::kWeave;
  std::optional<int> input;           ///< of a frame grabber
  std::string standard;               ///< "PAL" | "NTSC" | "SECAM"; empty: as the device stands
  std::vector<V4l2Control> controls;  ///< in this order, after the automatics are off
  bool keep_automatics = false;       ///< false: auto exposure, gain, white balance, focus ... are switched off
  std::optional<Duration> exposure;   ///< where the device cannot tell; absent there: half a frame period is assumed
  Duration readout{};                 ///< from the end of the exposure to the driver's end-of-frame stamp
  bool rolling_shutter = false;       ///< rows are exposed one after the other over `readout`
  StampClock stamp_clock = StampClock::kDeclared;
  StampPoint stamp_point = StampPoint::kDeclared;
  Duration stamp_sigma = std::chrono::microseconds{500};  ///< of a driver's stamp: interrupt latency
  int buffers = 4;
  Duration timeout = std::chrono::seconds{1};       ///< without a frame: stalled
  Duration retry = std::chrono::milliseconds{500};  ///< between two looks for a lost device
};

/// Uncompressed and without loss of resolution first.
std::vector<PixelFormat> preferred_formats(int channels);

/// A camera of the rig file's `devices`, with `driver: v4l2`.
extern const SettingsTable<V4l2CameraSettings> kV4l2Keys;

/// `name` and `channels` are the rig camera's.
/// Errors: InputError with file and line; the caller finishes the node.
V4l2CameraSettings v4l2_settings_from(const ConfigNode& node, const std::string& name, int channels);

}  // namespace tankrig
