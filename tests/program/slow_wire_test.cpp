// A whole scan on wires that asks little of the machine: for builds that are many times slower, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/can_log.hpp"
#include "session/reading/session.hpp"
#include "tests/program/program.hpp"
#include "tests/support/machine_witness.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

/// tank-wire with small stereo pictures and a fifth of the pace and of the sweep, without its watchdog box.
fs::path slow_rig() {
  const fs::path folder = scratch_folder() / "rig";
  EXPECT_EQ(run_tankrig({"init", folder.string(), "--from", "tank-wire"}).exit_code, 0);
  const Edits eyes{{"width_px: 640, height_px: 480, fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8",
                    "width_px: 160, height_px: 120, fx_px: 191.35, fy_px: 190.725, cx_px: 78.55, cy_px: 58.825"},
                   {"rate_hz: 25", "rate_hz: 5"}};
  edit(folder / "base.yaml", eyes);
  edit(folder / "base.yaml", eyes);
  edit(folder / "base.yaml", {{"rate_hz: 25", "rate_hz: 5"},
                              {"park_rad: [0, 0.13, 0.9, 0, 0.1]", "park_rad: [0, 0.13, 1.6, 0, 0.1]"},
                              {"posture_rad: [0, 0.13, 1.3, 0, 0.1]", "posture_rad: [0, 0.13, 1.65, 0, 0.1]"},
                              {"from_rad: 1.3", "from_rad: 1.65"},
                              {"to_rad: 2.1", "to_rad: 1.8"},
                              {"dark_frames: 10", "dark_frames: 5"},
                              {"feedback_timeout_s: 0.25", "feedback_timeout_s: 10"},
                              {"heartbeat_timeout_s: 0.25", "heartbeat_timeout_s: 10"},
                              {"max_joint_gap_s: 0.1", "max_joint_gap_s: 1"}});
  edit(folder / "rig.yaml",
       {{"  safety:\n", "  safety:\n    beam: {waived: [left, right]}\n"},  // too small to be witnesses
        {kShippedBox[0], "heartbeat_output: {kind: none}"},
        {kShippedBox[1], "enable_input: {kind: none}"},
        {"camera_lead_s: 0.5", "camera_lead_s: 2"},
        {"cycle_hz: 350", "cycle_hz: 50"},
        {"overruns: {limit: 100, window_s: 1}", "overruns: {limit: 0}"},
        {"exchange_rate_hz: 350", "exchange_rate_hz: 50"},
        {"exchange_rate_hz: 75", "exchange_rate_hz: 25"},
        {"reply_timeout_ms: 5 ", "reply_timeout_ms: 200 "},
        {"answer_timeout_ms: 200", "answer_timeout_ms: 1000, caller_timeout_ms: 2000"},
        {"zero_file:", "silence_timeout_ms: 5000\n    watchdog_ms: 10000\n    zero_file:"},
        {"power_up_rad: [0, 0.13, 0.9, 0, 0.1]", "power_up_rad: [0, 0.13, 1.6, 0, 0.1]"}});
  const Edits eyes_in_scene{{"<resw>640</resw><resh>480</resh>", "<resw>160</resw><resh>120</resh>"},
                            {"<fx>765.4</fx><fy>762.9</fy><x0>315.7</x0><y0>236.8</y0>",
                             "<fx>191.35</fx><fy>190.725</fy><x0>78.55</x0><y0>58.825</y0>"},
                            {"<rate>25</rate>", "<rate>5</rate>"}};
  edit(folder / "tank.xml", eyes_in_scene);
  edit(folder / "tank.xml", eyes_in_scene);
  edit(folder / "tank.xml", {{"<rate>25</rate>", "<rate>5</rate>"}});
  return folder;
}

class SlowWireScan : public testing::TestWithParam<const char*> {};

TEST_P(SlowWireScan, IsWholeAndReplaysToTheSameBits) {
  const fs::path session = scratch_folder() / "session";
  const testing_support::MachineWitness witness;
  const ProgramRun scan =
      run_tankrig({"scan", "--rig", slow_rig().string(), "--carrier", GetParam(), "--json", "--out", session.string()});
  if (forbids_private_network(scan)) GTEST_SKIP() << scan.err;
  if (scan.exit_code != 0) {
    TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  }
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
  EXPECT_LT(scan.json().at("laser").at("mean_error_m").get<double>(), 1e-3);
  EXPECT_EQ(run_tankrig({"session", "check", session.string()}).exit_code, 0);
  EXPECT_EQ(run_tankrig({"session", "replay", session.string()}).exit_code, 0);
  if (std::string(GetParam()) == "can") {
    const auto heard = read_can_log(session / "can.log").entries.size();
    EXPECT_GT(heard, 0u);
    EXPECT_EQ(static_cast<double>(heard), Session::open(session).info.devices.at("can_log.recorded"));
    const fs::path out = scratch_folder() / "export";
    EXPECT_EQ(
        run_tankrig({"session", "export", session.string(), "--format", "candump", "--out", out.string()}).exit_code,
        0);
    EXPECT_EQ(read_text(out / "candump.log"), read_text(session / "can.log"));
  }
}

INSTANTIATE_TEST_SUITE_P(Carriers, SlowWireScan, testing::Values("can", "serial"),
                         [](const auto& carrier) { return std::string(carrier.param); });

}  // namespace
}  // namespace tankrig::test
