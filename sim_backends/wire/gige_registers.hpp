// The memory of an emulated GigE Vision camera: its registers, and the description that tells clients of them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace tankrig::sim {

/// Addresses.
/// Source: AIA GigE Vision 2.0, chapter 28 (bootstrap registers); Aravis' arvfakecamera.h (the others).
namespace gige_register {
inline constexpr std::uint32_t kMacHigh = 0x0008, kMacLow = 0x000C, kAddress = 0x0024, kUserName = 0x00E8;
inline constexpr std::uint32_t kCapability = 0x0934, kHeartbeatMs = 0x0938;
inline constexpr std::uint32_t kTimestampControl = 0x0944, kTimestampValue = 0x0948;
inline constexpr std::uint32_t kControlPrivilege = 0x0A00;
inline constexpr std::uint32_t kStreamPort = 0x0D00, kStreamPacketSize = 0x0D04, kStreamAddress = 0x0D18;
inline constexpr std::uint32_t kWidth = 0x0100, kHeight = 0x0104, kOffsetX = 0x0130, kOffsetY = 0x0134;
inline constexpr std::uint32_t kSensorHeight = 0x0118, kSensorWidth = 0x011C, kExposureUs = 0x0120;
inline constexpr std::uint32_t kAcquisition = 0x0124, kPixelFormat = 0x0128, kFramePeriodUs = 0x0138;
inline constexpr std::uint32_t kTriggerMode = 0x0300, kTriggerSource = 0x0304, kTriggerSoftware = 0x030C;
}  // namespace gige_register

/// Registers and GenICam description of Aravis' fake camera.
/// Threads: any.
class GigeRegisters {
 public:
  explicit GigeRegisters(const std::string& serial);
  ~GigeRegisters();
  GigeRegisters(const GigeRegisters&) = delete;
  GigeRegisters& operator=(const GigeRegisters&) = delete;

  /// Of a 32-bit register; 0 where there is none.
  std::uint32_t get(std::uint32_t address) const;
  void set(std::uint32_t address, std::uint32_t value);
  /// Bytes in wire order. False, with nothing done, outside of the memory. The description is read-only.
  bool read(std::uint32_t address, std::span<std::uint8_t> bytes) const;
  bool write(std::uint32_t address, std::span<const std::uint8_t> bytes);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace tankrig::sim
