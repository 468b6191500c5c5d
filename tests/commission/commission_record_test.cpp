#include "rig/commission/commission_record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;
using Step = CommissionStep;
using Verdict = CommissionVerdict;

RigConfig some_rig() { return load_rig(std::filesystem::path(TANKRIG_SOURCE_DIR) / "etc/rigs/tank-wire/rig.yaml"); }

CommissionRecord some_record(const RigConfig& rig) {
  CommissionRecord record{rig.name, commission_basis_sha256(rig), "2026-01-31T12:00:00Z", "Anna \"A\"", "0.1.0", {}};
  for (std::size_t i = 0; i < kNames<Step>.size(); ++i)
    record.findings.push_back({static_cast<Step>(i), Verdict::kPassed, "well: 1 of 1"});
  record.findings.back().verdict = Verdict::kWaived;
  return record;
}

constexpr std::time_t kMade = 1769860800;  // date -u -d 2026-01-31T12:00:00Z +%s

TEST(CommissionRecord, ReadsBackAsItWasWritten) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "rig.commission.yaml";
  const CommissionRecord record = some_record(some_rig());
  write_commission(file, record);
  EXPECT_EQ(commission_text(read_commission(file)), commission_text(record));
  EXPECT_EQ(read_commission(file).in_words(), "by Anna \"A\" at 2026-01-31T12:00:00Z, waived: enable");
}

std::string refusal(const std::string& from, const std::string& to) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "rig.commission.yaml";
  std::string text = commission_text(some_record(some_rig()));
  text.replace(text.find(from), from.size(), to);
  folder.write("rig.commission.yaml", text);
  try {
    (void)read_commission(file);
  } catch (const InputError& e) {
    return e.what();
  }
  return "read";
}

TEST(CommissionRecord, IsRefusedWhereItWasTamperedWithOrCut) {
  EXPECT_THAT(refusal("step: lid", "step: beam"), HasSubstr("findings: found other steps")) << "twice the beam";
  EXPECT_THAT(refusal("12:00:00Z", "noon"), HasSubstr("expected a time like 2026-01-31T12:00:00Z"));
  EXPECT_THAT(refusal("tankrig-commission 1", "tankrig-commission 2"), HasSubstr("format: found"));
  EXPECT_THAT(refusal("rig: ", "rigs: "), HasSubstr("rig"));
}

TEST(CommissionRecord, AllowsAStartForItsTimeOnly) {
  const RigConfig rig = some_rig();
  const CommissionRecord record = some_record(rig);
  EXPECT_EQ(commission_objection(record, rig, 24, kMade), "");
  EXPECT_EQ(commission_objection(record, rig, 24, kMade + 24 * 3600), "");
  EXPECT_THAT(commission_objection(record, rig, 24, kMade + 25 * 3600),
              HasSubstr("is 25.0 h old, expected at most 24 h"));
  EXPECT_EQ(commission_objection(record, rig, 24, kMade - 30), "") << "a clock that was set by seconds";
  EXPECT_THAT(commission_objection(record, rig, 24, kMade - 3600), HasSubstr("made in the future"));
}

TEST(CommissionRecord, AllowsNoStartAfterAFailureOrAChange) {
  RigConfig rig = some_rig();
  CommissionRecord record = some_record(rig);
  record.findings[3].verdict = Verdict::kFailed;
  EXPECT_THAT(commission_objection(record, rig, 24, kMade), HasSubstr("steps that failed (lid)"));
  record = some_record(rig);
  record.rig = "another";
  EXPECT_THAT(commission_objection(record, rig, 24, kMade), HasSubstr("is of the rig another"));
  record = some_record(rig);
  record.rig_sha256[0] = record.rig_sha256[0] == '0' ? '1' : '0';
  EXPECT_THAT(commission_objection(record, rig, 24, kMade), HasSubstr("before the rig file was changed"));
  record.findings.clear();
  EXPECT_FALSE(record.passed());
}

TEST(CommissionRecord, IsAskedForByRigsWithDevices) {
  SafetySettings safety;
  EXPECT_EQ(commission_age_limit_h(safety, true), 24);
  EXPECT_EQ(commission_age_limit_h(safety, false), std::nullopt);
  safety.commissioned_within_h = 12;
  EXPECT_EQ(commission_age_limit_h(safety, true), 12);
  EXPECT_EQ(commission_age_limit_h(safety, false), 12);
}

TEST(CommissionRecord, StandsBesideTheRigFile) {
  EXPECT_EQ(commission_file(some_rig()).filename(), "rig.commission.yaml");
}

}  // namespace
}  // namespace tankrig
