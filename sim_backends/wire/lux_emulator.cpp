#include "sim_backends/wire/lux_emulator.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/settings_table.hpp"
#include "drivers/lux/open_lux_meter.hpp"

namespace tankrig::sim {
namespace {

constexpr Duration kIdle = std::chrono::seconds{1};
constexpr std::array<std::uint8_t, 2> kPce174Prefix{0x87, 0x83};
constexpr std::uint8_t kPce174HoldKey = 0xEF, kPce174UnitsKey = 0xFE;

const Setting<LuxEmulatorSettings> kLuxEmulatorRows[] = {
    {"answer_delay_ms", &LuxEmulatorSettings::answer_delay, ConfigRange(0, 10'000), "of every answer"},
};

}  // namespace

constinit const SettingsTable<LuxEmulatorSettings> kLuxEmulatorKeys{kLuxEmulatorRows};

LuxEmulatorSettings lux_emulator_settings_from(const ConfigNode& lux_meter, const ConfigNode* emulation,
                                               const std::filesystem::path& runtime) {
  const LuxMeterSettings driver = lux_meter_settings_from(lux_meter, runtime);
  LuxEmulatorSettings s;
  s.name = std::visit([](const auto& meter) { return meter.device; }, driver);
  if (const auto* t10a = std::get_if<T10aSettings>(&driver))
    s.kind = LuxMeterKind::kT10a, s.unit = t10a->unit, s.head = t10a->head;
  if (emulation) read_settings(*emulation, kLuxEmulatorKeys, s);
  return s;
}

LuxEmulator::LuxEmulator(LuxEmulatorSettings settings, std::function<double()> illuminance)
    : settings_(std::move(settings)),
      illuminance_(std::move(illuminance)),
      answer_delay_ns_(settings_.answer_delay.count()),
      foot_candle_(settings_.unit == LuxUnit::kFootCandle),
      server_(
          settings_.name, [this](std::span<const std::uint8_t> bytes) { receive(bytes); }, [] { return kIdle; }) {}

void LuxEmulator::unplug() {
  server_.unplug();
  pc_mode_ = false;
}

MeterState LuxEmulator::state() const {
  return {foot_candle_ ? LuxUnit::kFootCandle : LuxUnit::kLux, hold_, low_battery_, settings_.head};
}

void LuxEmulator::receive(std::span<const std::uint8_t> bytes) {
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  while (settings_.kind == LuxMeterKind::kPce174 ? take_pce174() : take_t10a()) {
  }
}

/// False when what is left is no whole command.
bool LuxEmulator::take_pce174() {
  const auto start = std::search(pending_.begin(), pending_.end(), kPce174Prefix.begin(), kPce174Prefix.end());
  if (start == pending_.end()) {
    if (!pending_.empty()) pending_.erase(pending_.begin(), pending_.end() - 1);
    return false;
  }
  if (pending_.end() - start < 3) return false;
  const std::uint8_t code = start[2];
  pending_.erase(pending_.begin(), start + 3);
  if (code == kPce174HoldKey) hold_ = !hold_;
  if (code == kPce174UnitsKey) foot_candle_ = !foot_candle_;
  if (code == kPce174LiveRequest[2]) answer(encode_pce174_live(illuminance_(), state()));
  return true;
}

bool LuxEmulator::take_t10a() {
  pending_.erase(pending_.begin(), std::find(pending_.begin(), pending_.end(), kT10aStx));
  if (pending_.size() < kT10aShortBytes) return false;
  const auto command = decode_t10a_short(std::span(pending_).first(kT10aShortBytes));
  if (!command.ok()) {
    pending_.erase(pending_.begin());
    return true;
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(kT10aShortBytes));
  if (command.value().command == 54) {
    pc_mode_ = true;
    answer(encode_t10a(0, 54, "    "));
  } else if (pc_mode_ && command.value().command == 10 && command.value().head == settings_.head) {
    answer(encode_t10a_measurement(illuminance_(), state()));
  }
  return true;
}

void LuxEmulator::answer(std::span<const std::uint8_t> frame) {
  const LuxFault fault = fault_;
  const Duration delay{answer_delay_ns_};
  std::vector<std::uint8_t> bytes(frame.begin(), frame.end());
  const std::vector<std::uint8_t> noise{0x00, 0x02, 0xAA, 0xFF, 0xAA, 0xDD, 0x31};
  if (fault == LuxFault::kSilent) return;
  if (fault == LuxFault::kGarbage) bytes.insert(bytes.begin(), noise.begin(), noise.end());
  if (fault == LuxFault::kNonsense) bytes = noise;
  if (fault == LuxFault::kTruncated) bytes.pop_back();
  if (fault == LuxFault::kWrongChecksum) bytes[11] ^= 0x01;
  server_.answer(bytes, delay);
}

}  // namespace tankrig::sim
