// session.yaml damaged anywhere: every section is regained or named as lost, and no calibration is taken for the
// recorded one that is not proven to be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/text_files.hpp"
#include "session/checking/examination.hpp"
#include "session/checking/session_recover.hpp"
#include "session/checking/sha256.hpp"
#include "session/reading/session_yaml.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// With every section there is.
SessionInfo full_info() {
  SessionInfo info = some_info();
  info.name = "s";
  info.status = "stopped: recovered, 1 losses";
  info.created_utc = "2026-01-02T03:04:05Z";
  info.commission = "by Anna at 2026-01-02T02:04:05Z, waived: enable";
  info.rig_hash = sha256_of_text("the rig\n");
  info.truth_seed = 6;
  info.lux_after = 208.25;
  info.lux_uncertainty = 6.25;
  info.account = {{"left", {12, -1}}, {"mono", {171, 0}}};
  info.tables = {{"joints", {48, {1'000'000'000}, {1'235'000'000}}}, {"frames", {6, {1'000'000'000}, {1'200'000'000}}}};
  info.recovered = {"joints.csv: 3 lines cannot be read and are left out", "camera mono: \"one\" frame"};
  return info;
}

/// The lines of a section; empty if it has none.
std::string section_of(const std::string& yaml, const std::string& key) {
  const std::size_t begin = yaml.starts_with(key + ":") ? 0 : yaml.find("\n" + key + ":") + 1;
  if (begin == 0 && !yaml.starts_with(key + ":")) return "";
  std::size_t end = begin;
  do end = yaml.find('\n', end) + 1;
  while (end < yaml.size() && yaml[end] == ' ');
  return yaml.substr(begin, end - begin);
}

std::vector<std::string> named_as_lost(const SessionFindings& found) {
  const std::string before = "lost, as far as there was any: ";
  std::vector<std::string> keys;
  for (const std::string& loss : found.losses) {
    std::size_t at = loss.find(before);
    if (at == std::string::npos) continue;
    for (at += before.size(); at < loss.size();) {
      const std::size_t end = std::min(loss.find(", ", at), loss.size());
      keys.push_back(loss.substr(at, end - at));
      at = end + 2;
    }
  }
  return keys;
}

class DamagedSessionYaml : public testing::Test {
 protected:
  DamagedSessionYaml() {
    folder_.write("s/rig.yaml", "the rig\n");
    write(whole_);
  }
  void write(const std::string& yaml) { folder_.write("s/session.yaml", yaml); }
  SessionFindings examined(const DescribeRig& how = describe_rig) {
    Examination so_far;
    so_far.session = folder_.path() / "s";
    examine_session_yaml(so_far, how);
    return so_far;
  }
  /// Every section as it was, or named. Returns how many are named.
  std::size_t expect_regained_or_named(const SessionFindings& found) {
    const std::string regained = session_yaml(found.info, found.calibration);
    const std::vector<std::string> lost = named_as_lost(found);
    for (const Setting<SessionInfo>& section : kSessionKeys.rows)
      if (section_of(regained, section.name) != section_of(whole_, section.name)) {
        EXPECT_THAT(lost, Contains(section.name)) << found.losses.front();
      }
    EXPECT_EQ(found.calibration, recorded_calibration(whole_));
    return lost.size();
  }

  const InMemory in_memory_;
  const TemporaryFolder folder_;
  const std::string whole_ = session_yaml(full_info());
};

TEST_F(DamagedSessionYaml, IsWholeWhenItIs) {
  const SessionFindings found = examined();
  EXPECT_THAT(found.losses, IsEmpty());
  EXPECT_FALSE(found.info_damaged);
  EXPECT_EQ(expect_regained_or_named(found), 0u);
}

TEST_F(DamagedSessionYaml, WithOneBadByteKeepsEverySectionButThoseItNames) {
  constexpr unsigned kSeed = 1;
  std::mt19937 random(kSeed);
  int damaged = 0;
  for (int i = 0; i < 600; ++i) {
    std::string yaml = whole_;
    const std::size_t at = random() % yaml.size();
    yaml[at] = static_cast<char>(yaml[at] ^ 1 << random() % 8);
    write(yaml);
    SCOPED_TRACE("byte " + std::to_string(at) + ", seed " + std::to_string(kSeed));
    const SessionFindings found = examined();
    ASSERT_TRUE(found.info_known);
    if (!found.info_damaged) continue;  // another good value: the seal tells
    ++damaged;
    EXPECT_LE(expect_regained_or_named(found), 4u);
    if (HasFailure()) break;
  }
  EXPECT_GT(damaged, 100) << "seed " << kSeed;
}

TEST_F(DamagedSessionYaml, CutAnywhereKeepsWhatStandsBeforeTheCut) {
  constexpr unsigned kSeed = 2;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const std::size_t at = random() % (whole_.size() - 1);
    write(whole_.substr(0, at));
    SCOPED_TRACE("cut at " + std::to_string(at) + ", seed " + std::to_string(kSeed));
    const SessionFindings found = examined();
    ASSERT_TRUE(found.info_damaged);
    ASSERT_TRUE(found.info_known);
    const std::size_t named = expect_regained_or_named(found);
    std::size_t whole = 0;
    for (const Setting<SessionInfo>& section : kSessionKeys.rows) {
      const std::string lines = section_of(whole_, section.name);
      whole += whole_.find(lines) + lines.size() <= at;
    }
    EXPECT_LE(named + whole, kSessionKeys.rows.size() + 1) << "the last one may lack lines";
    if (HasFailure()) break;
  }
}

TEST_F(DamagedSessionYaml, WithABadHashIsProvenByTheRigThatSaysTheSame) {
  std::string yaml = whole_;
  char& digit = yaml[yaml.find("calibration_sha256: \"") + 21];
  digit = digit == '0' ? '1' : '0';
  write(yaml);
  const SessionFindings found = examined();
  EXPECT_THAT(found.losses, ElementsAre(HasSubstr("the SHA-256 of its calibration is damaged")));
  EXPECT_EQ(session_yaml(found.info, found.calibration), whole_);
}

TEST_F(DamagedSessionYaml, KeepsItsOwnCalibrationToTheLetterWhereItIsWhole) {
  std::string yaml = whole_;
  yaml.replace(yaml.find("seed: "), 6, "sead: ");
  write(yaml);
  const SessionFindings found = examined({});
  EXPECT_TRUE(found.info_known) << "without a rig file";
  EXPECT_THAT(named_as_lost(found), ElementsAre("seed"));
  EXPECT_EQ(found.calibration, recorded_calibration(whole_));
}

TEST(SessionRecover, KeepsTheHashOfACalibrationThatNothingProves) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  folder.write("s/box.obj", "v 0 0 0\n");
  std::string yaml = folder.read("s/session.yaml");
  const std::string hash = section_of(yaml, "calibration_sha256");
  folder.write("s/session.yaml", yaml.replace(yaml.find("k1: -0.37"), 9, "k1: -0.38"));
  const RecoverOptions options{.out = {}, .describe = describe_rig, .pictures = {}};  // there is no rig.yaml
  EXPECT_TRUE(recover_session(path, options).finished);
  EXPECT_EQ(section_of(folder.read("s/session.yaml"), "calibration_sha256"), hash);
  const Session session = Session::open(path);
  EXPECT_THAT(session.warnings, ElementsAre(HasSubstr("calibration in session.yaml was changed")));
  EXPECT_THAT(session.info.recovered, Contains(HasSubstr("the calibration is not proven")));
  EXPECT_TRUE(examine_session(path, describe_rig).whole()) << "told once";
  folder.write("s/rig.yaml", "the rig\n");
  EXPECT_TRUE(recover_session(path, options).finished);
  EXPECT_THAT(Session::open(path).warnings, IsEmpty()) << "proven at last";
  EXPECT_EQ(Session::open(path).info.cameras[0].model.k1, kSmall.k1);
}

TEST(SessionRecover, KeepsTheCalibrationToTheLetter) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  const std::string calibration = recorded_calibration(folder.read("s/session.yaml"));
  fs::remove(path / "frames/mono/000002.png");
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_EQ(recorded_calibration(folder.read("s/session.yaml")), calibration);
}

}  // namespace
}  // namespace tankrig
