#include "sim_backends/wire/gige_registers.hpp"

#include <arv.h>

#include <algorithm>
#include <array>
#include <mutex>

namespace tankrig::sim {

static_assert(gige_register::kAcquisition == ARV_FAKE_CAMERA_REGISTER_ACQUISITION);
static_assert(gige_register::kTriggerSoftware == ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE);
static_assert(gige_register::kFramePeriodUs == ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US);

struct GigeRegisters::Memory {
  explicit Memory(const char* serial) : camera(arv_fake_camera_new(serial)) {
    arv_fake_camera_get_genicam_xml(camera, &description_size);
  }
  ~Memory() { g_object_unref(camera); }

  std::mutex mutex;  ///< what the camera holds
  ArvFakeCamera* camera;
  std::size_t description_size = 0;  ///< it begins behind the registers
};

GigeRegisters::GigeRegisters(const std::string& serial) : memory_(std::make_unique<Memory>(serial.c_str())) {}
GigeRegisters::~GigeRegisters() = default;

std::uint32_t GigeRegisters::get(std::uint32_t address) const {
  std::array<std::uint8_t, 4> b{};
  read(address, b);
  return static_cast<std::uint32_t>(b[0]) << 24 | static_cast<std::uint32_t>(b[1]) << 16 |
         static_cast<std::uint32_t>(b[2]) << 8 | b[3];
}

void GigeRegisters::set(std::uint32_t address, std::uint32_t value) {
  const auto byte = [value](int shift) { return static_cast<std::uint8_t>(value >> shift); };
  write(address, std::array{byte(24), byte(16), byte(8), byte(0)});
}

bool GigeRegisters::read(std::uint32_t address, std::span<std::uint8_t> bytes) const {
  const std::uint64_t end = std::uint64_t{address} + bytes.size();
  if (bytes.empty()) return false;
  if (address < ARV_FAKE_CAMERA_MEMORY_SIZE ? end >= ARV_FAKE_CAMERA_MEMORY_SIZE
                                            : address >= ARV_FAKE_CAMERA_MEMORY_SIZE + memory_->description_size)
    return false;
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});  // a last block may reach beyond the description's end
  const std::lock_guard lock(memory_->mutex);
  return arv_fake_camera_read_memory(memory_->camera, address, static_cast<guint32>(bytes.size()), bytes.data());
}

bool GigeRegisters::write(std::uint32_t address, std::span<const std::uint8_t> bytes) {
  const std::uint64_t end = std::uint64_t{address} + bytes.size();
  if (bytes.empty() || end >= ARV_FAKE_CAMERA_MEMORY_SIZE) return false;
  const std::lock_guard lock(memory_->mutex);
  return arv_fake_camera_write_memory(memory_->camera, address, static_cast<guint32>(bytes.size()), bytes.data());
}

}  // namespace tankrig::sim
