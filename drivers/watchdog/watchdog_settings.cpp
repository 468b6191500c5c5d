#include "drivers/watchdog/watchdog_settings.hpp"

#include "core/settings_table.hpp"

namespace tankrig {
namespace {

const Setting<HeartbeatOutput> kHeartbeatOutputRows[] = {
    {"kind", &HeartbeatOutput::kind,
     "how a watchdog box is kept awake: a control line that toggles, or numbered bytes (watchdog_box.md)"},
    {"device", &HeartbeatOutput::device, "its serial line, /dev/ttyS0, or runtime/NAME for an emulated one",
     Need::kSparse},
    {"baud", &HeartbeatOutput::baud, ConfigRange(9600, 4e6), "of `bytes`"},
    {"half_period_ms", &HeartbeatOutput::half_period, ConfigRange(5, 50),
     "between two edges, or two frames of bytes; at least two cycles"},
};
void check_heartbeat(const ConfigNode& node, const HeartbeatOutput& output) {
  if (output.kind != HeartbeatKind::kNone && output.device.empty())
    node.fail("kind", "found no device beside it, expected the serial line of the watchdog box");
}

const Setting<EnableInput> kEnableInputRows[] = {
    {"kind", &EnableInput::kind,
     "how the box says that it feeds arm and laser: a control line, or its reply to `bytes`; light and motion need it"},
    {"device", &EnableInput::device, "its serial line; left out: that of `heartbeat_output`", Need::kSparse},
    {"closed_is_on", &EnableInput::closed_is_on, "of a control line: on, a positive voltage, means enabled"},
    {"wait_s", &EnableInput::wait, ConfigRange(1, 600), "so long a command waits for the box to be reset by hand"},
};

}  // namespace

constinit const SettingsTable<HeartbeatOutput> kHeartbeatOutputKeys{kHeartbeatOutputRows, check_heartbeat};
constinit const SettingsTable<EnableInput> kEnableInputKeys{kEnableInputRows};

}  // namespace tankrig
