#include "drivers/watchdog/watchdog_settings.hpp"

#include "core/settings_table.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kLine{-1, 1023};
constexpr char kNoLine[] = "found gpio without chip and line beside it, expected both, /dev/gpiochip0 and a number";

const Setting<HeartbeatOutput> kHeartbeatOutputRows[] = {
    {"kind", &HeartbeatOutput::kind,
     "what keeps a watchdog box awake: a line that toggles, or numbered bytes ([watchdog_box.md](watchdog_box.md))"},
    {"device", &HeartbeatOutput::device, "its serial line, /dev/ttyS0, or runtime/NAME for an emulated one",
     Need::kSparse},
    {"chip", &HeartbeatOutput::chip, "of `gpio`: /dev/gpiochip0", Need::kSparse},
    {"line", &HeartbeatOutput::line, kLine, "of `gpio`: its number on the chip; -1: none"},
    {"baud", &HeartbeatOutput::baud, ConfigRange(9600, 4e6), "of `bytes`"},
    {"half_period_ms", &HeartbeatOutput::half_period, ConfigRange(5, 50),
     "between two edges, or two frames of bytes; at least two cycles"},
};
void check_heartbeat(const ConfigNode& node, const HeartbeatOutput& output) {
  if (output.kind == HeartbeatKind::kGpio) {
    if (output.chip.empty() || output.line < 0) node.fail("kind", kNoLine);
  } else if (output.kind != HeartbeatKind::kNone && output.device.empty()) {
    node.fail("kind", "found no device beside it, expected the serial line of the watchdog box");
  }
}

const Setting<EnableInput> kEnableInputRows[] = {
    {"kind", &EnableInput::kind,
     "how the box says that it feeds arm and laser: a line, or its reply to `bytes`; light and motion need it"},
    {"device", &EnableInput::device, "its serial line; left out: that of `heartbeat_output`", Need::kSparse},
    {"chip", &EnableInput::chip, "of `gpio`; left out: that of `heartbeat_output`", Need::kSparse},
    {"line", &EnableInput::line, kLine, "of `gpio`: its number on the chip; -1: none"},
    {"closed_is_on", &EnableInput::closed_is_on,
     "of a control line: on, a positive voltage, means enabled; of `gpio`: high"},
    {"wait_s", &EnableInput::wait, ConfigRange(1, 600), "so long a command waits for the box to be reset by hand"},
};

void check_enable(const ConfigNode& node, const EnableInput& input) {
  if (input.kind == EnableKind::kGpio && input.line < 0)
    node.fail("kind", "found gpio without a line beside it, expected its number on the chip");
}

}  // namespace

constinit const SettingsTable<HeartbeatOutput> kHeartbeatOutputKeys{kHeartbeatOutputRows, check_heartbeat};
constinit const SettingsTable<EnableInput> kEnableInputKeys{kEnableInputRows, check_enable};

}  // namespace tankrig
