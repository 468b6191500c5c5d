// An emulated GigE Vision camera on a loopback address: real packets, pictures from the world.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "core/result.hpp"
#include "core/time.hpp"

namespace tankrig::sim {

/// Renders the exposure [begin, begin + exposure]: 8 bit, 1 channel or 3 (BGR), of the sensor's size. Called from the
/// camera's own thread after the exposure. Frames without a receiver are not rendered.
using GigePicture = std::function<cv::Mat(std::uint64_t index, Stamp begin, Duration exposure)>;

/// Reports an exposure before its picture is rendered. From the camera's own thread.
using GigeTruth = std::function<void(std::uint64_t index, Stamp begin, Duration exposure)>;

struct GigeCameraSettings {
  std::string address = "127.0.0.1";  ///< an address of a network interface of this machine; port 3956 must be free
  std::string serial = "EMULATED-1";  ///< at most 15 characters
  std::string user_id;                ///< name in the camera's memory, at most 15 characters
  int width = 640, height = 480;      ///< sensor, at most 8192
  std::string pixel_format =
      "Mono8";                 ///< at power-up: Mono8 | Mono16 | RGB8 | BayerRG8 | BayerGB8 | BayerGR8 | BayerBG8
  double rate_hz = 25;         ///< at power-up, 0.1 .. 1000
  double exposure_us = 10000;  ///< at power-up
  std::int64_t clock_start_ns = 5'000'000'000'000;  ///< its clock at power-up
  double clock_drift_ppm = 0;                       ///< its clock runs fast by this
  bool claims_resend = false;                       ///< claims that it resends packets, which it never does
  bool timestamp_latch = true;  ///< answers the timestamp latch; without it the latched value never changes
};

/// A GigE Vision camera with the registers and description of Aravis' fake one. It obeys the client's region, pixel
/// format, exposure and rate; GigeExposures says when it exposes. A frame's device stamp is the start of its exposure.
/// A free-running exposure without time to render is skipped, with its number. Frame numbers start at 65401, so they
/// wrap after 135 frames. Not supported: packet resends, test packets, line triggers (its registers accept them).
/// Threads: all members from any thread.
class GigeCameraEmulator {
 public:
  /// Errors: InputError if the address is no address of this machine or its GigE Vision port is taken.
  GigeCameraEmulator(const GigeCameraSettings& settings, GigePicture picture, GigeTruth truth = nullptr);
  ~GigeCameraEmulator();
  GigeCameraEmulator(const GigeCameraEmulator&) = delete;
  GigeCameraEmulator& operator=(const GigeCameraEmulator&) = delete;

  /// Drops packets with this probability; 1 is a camera that answers but sends no frames.
  void lose_packets(double ratio);
  void stall(bool stalled) { lose_packets(stalled ? 1.0 : 0.0); }
  /// Sends pictures of half the height in frames that promise the whole.
  void send_short_pictures(bool yes);
  /// No answer on any port until plug(). Then the camera restarts with its power-up settings; its clock has gone on.
  void unplug();
  void plug();
  /// Sets its clock forward or back.
  void step_clock(Duration by);

  std::int64_t device_time(Stamp host) const;
  std::uint64_t exposures() const;         ///< since power-up of the emulator; all that were made
  std::uint64_t sent() const;              ///< of these: whose last packet has left, or was lost
  std::uint64_t skipped() const;           ///< times of the grid that passed while a picture was rendered or sent
  std::uint64_t triggers_ignored() const;  ///< software triggers that came while it was exposing, or was not armed
  std::uint64_t latches() const;
  /// A register as the client left it, 0 while unplugged.
  std::uint32_t read_register(std::uint32_t address) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig::sim
