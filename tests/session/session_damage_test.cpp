// A finished session and a killed one, damaged in every way: check is never wrong, recover makes whole what is left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <random>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "session/checking/sha256.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr int kFrames = 6, kJointSamples = 8 * kFrames;

SessionInfo info_with_rig() {
  SessionInfo info = some_info();
  info.rig_hash = sha256_of_text("the rig\n");
  return info;
}

/// Sealed, with a cloud made of it.
fs::path finished(const TemporaryFolder& folder) {
  SessionWriter writer(folder.path() / "s", info_with_rig());
  writer.add_text("rig.yaml", "the rig\n");
  writer.add_text("box.obj", "v 0 0 0\n");
  record(writer, kFrames);
  writer.close("complete");
  folder.write("s/clouds/laser.ply", "a cloud of points");
  write_checksums(folder.path() / "s");
  return folder.path() / "s";
}

/// As a kill leaves it: frames in the spool, no end.
fs::path killed(const TemporaryFolder& folder) {
  const fs::path live = folder.path() / "live", path = folder.path() / "s";
  SessionWriter writer(live, info_with_rig());
  writer.add_text("rig.yaml", "the rig\n");
  writer.add_text("box.obj", "v 0 0 0\n");
  record(writer, kFrames);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (folder.read("live/frames.csv").find("/000005.png") == std::string::npos ||
         folder.read("live/events.csv").find("begins") == std::string::npos)
    if (std::chrono::steady_clock::now() > give_up) throw std::runtime_error("the recorder writes nothing");
  fs::copy(live, path, fs::copy_options::recursive);
  return path;
}

/// What holds of every session after recover, whatever it was before.
void expect_mended(const fs::path& path) {
  const SessionFindings after = examine_session(path, describe_rig);
  EXPECT_THAT(after.losses, IsEmpty());
  EXPECT_THAT(after.undone, IsEmpty());
  EXPECT_TRUE(compare_checksums(path).empty());
  const Session session = Session::open(path);
  EXPECT_THAT(session.warnings, IsEmpty());
  EXPECT_EQ(session.frames.size(), after.frames.records.size());
  EXPECT_FALSE(has_spool(path));
  for (const FrameRecord& frame : session.frames)
    EXPECT_EQ(cv::norm(session.image(frame), test_image(frame.index), cv::NORM_INF), 0);
}

std::vector<std::string> files_of(const fs::path& path) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(path).generic_string());
  std::sort(files.begin(), files.end());
  return files;
}

enum class Hurt { kCut, kDelete, kFlip };

std::string hurt(const fs::path& path, const std::string& file, Hurt how, std::mt19937& random) {
  if (how == Hurt::kDelete) {
    fs::remove(path / file);
    return file + " deleted";
  }
  std::string text = read_whole_file(path / file);
  const std::size_t at = random() % text.size();
  if (how == Hurt::kCut)
    text.resize(at);
  else
    text[at] = static_cast<char>(text[at] ^ 1 << random() % 8);
  write_whole_file(path / file, text);
  return file + (how == Hurt::kCut ? " cut at " : " flipped in ") + std::to_string(at);
}

TEST(SessionCheck, FindsAFinishedSessionWhole) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const SessionFindings found = examine_session(finished(folder), describe_rig);
  EXPECT_TRUE(found.whole());
  EXPECT_TRUE(found.usable());
  EXPECT_EQ(found.joints.records.size(), static_cast<std::size_t>(kJointSamples));
  const Recovery done = recover_session(folder.path() / "s", {.out = {}, .describe = describe_rig, .pictures = {}});
  EXPECT_TRUE(done.finished);
  EXPECT_FALSE(fs::exists(folder.path() / "s/lost+found")) << "nothing to do";
}

TEST(SessionCheck, FindsASessionWholeBesideFilesThatWereNeverFinished) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  for (const bool sealed_since : {false, true}) {
    for (const char* file : {"x.yaml", "session.yaml", "clouds/laser.ply", "frames/mono/000001.png"})
      folder.write("s/" + std::string(file) + kUnfinished, "a part of");
    if (sealed_since) write_checksums(path);
    EXPECT_THAT(folder.read("s/SHA256SUMS"), Not(HasSubstr(kUnfinished)));
    const SessionFindings found = examine_session(path, describe_rig);
    EXPECT_THAT(found.losses, IsEmpty());
    EXPECT_THAT(found.undone, IsEmpty());
    EXPECT_THAT(found.extra, IsEmpty());
    EXPECT_EQ(found.frames.records.size(), static_cast<std::size_t>(kFrames));
  }
}

TEST(SessionCheck, IsRightAboutAFinishedSessionCutDeletedOrFlippedAnywhere) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path original = finished(folder), path = folder.path() / "hurt";
  const std::vector<std::string> files = files_of(original);
  constexpr unsigned kSeed = 1;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 240; ++i) {
    fs::remove_all(path);
    fs::copy(original, path, fs::copy_options::recursive);
    const std::string file = files[static_cast<std::size_t>(i / 3) % files.size()];
    SCOPED_TRACE(hurt(path, file, static_cast<Hurt>(i % 3), random) + ", seed " + std::to_string(kSeed));
    const SessionFindings found = examine_session(path, describe_rig);
    ASSERT_FALSE(found.whole());
    ASSERT_TRUE(found.usable());
    if (file != "SHA256SUMS") {
      EXPECT_EQ(found.losses.empty(), is_derived(file));
    }
    const Recovery done = recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
    EXPECT_TRUE(done.finished);
    expect_mended(path);
    if (file != "frames.csv" && !file.starts_with("frames/")) {
      EXPECT_EQ(Session::open(path).frames.size(), static_cast<std::size_t>(kFrames));
    }
    if (testing::Test::HasFailure()) break;
  }
}

TEST(SessionCheck, LeavesOutAFrameOfNoCameraOfTheSession) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  std::string text = read_whole_file(path / "frames.csv");
  const std::size_t second_frame = text.find('\n', text.find('\n') + 1) + 1;
  text[second_frame] ^= 1;  // "mono", "lono"
  write_whole_file(path / "frames.csv", text);
  EXPECT_THAT(examine_session(path, describe_rig).losses, testing::Contains(testing::HasSubstr("frames.csv: 1 line")));
  EXPECT_TRUE(recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}}).finished);
  expect_mended(path);
  EXPECT_EQ(Session::open(path).frames.size(), static_cast<std::size_t>(kFrames - 1));
}

TEST(SessionCheck, IsRightAboutAKilledSessionCutOrDeletedAnywhere) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path original = killed(folder), path = folder.path() / "hurt";
  const std::vector<std::string> files = files_of(original);
  constexpr unsigned kSeed = 2;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 120; ++i) {
    fs::remove_all(path);
    fs::copy(original, path, fs::copy_options::recursive);
    const std::string file = files[static_cast<std::size_t>(i / 2) % files.size()];
    SCOPED_TRACE(hurt(path, file, static_cast<Hurt>(i % 2), random) + ", seed " + std::to_string(kSeed));
    const SessionFindings found = examine_session(path, describe_rig);
    ASSERT_FALSE(found.whole());
    ASSERT_TRUE(found.usable());
    if (!file.starts_with("spool/")) {
      EXPECT_EQ(found.frames.records.size(), static_cast<std::size_t>(kFrames)) << "the spool has its lines too";
    }
    const Recovery done = recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
    EXPECT_TRUE(done.finished);
    expect_mended(path);
    if (testing::Test::HasFailure()) break;
  }
}

TEST(SessionCheck, SaysInPlainWordsWhatATruncatedTableLost) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  std::string joints = folder.read("s/joints.csv");
  for (int i = 0; i < 10; ++i) joints.resize(joints.rfind('\n', joints.size() - 2) + 1);
  folder.write("s/joints.csv", joints.substr(0, joints.size() - 5));
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_THAT(found.losses, ElementsAre("joints.csv: 1 line cannot be read and is left out",
                                        "joints.csv: 37 of 48 lines there, the end lost from 0.180 s to 0.235 s"));
}

TEST(SessionCheck, SaysWhichFramesLostTheirPicture) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  fs::remove(path / "frames/mono/000002.png");
  fs::resize_file(path / "frames/mono/000003.png", 40);
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_THAT(found.losses,
              ElementsAre("camera mono: 2 frames without a whole picture, from 0.080 s to 0.120 s: 2, 3"));
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  const Session session = Session::open(path);
  EXPECT_EQ(session.frames.size(), 4u);
  EXPECT_EQ(session.info.status, "stopped: recovered, 1 losses");
  EXPECT_EQ(session.info.recovered, found.losses);
  EXPECT_EQ(session.info.counts.at("mono.recorded"), 4u);
  EXPECT_TRUE(fs::exists(path / "lost+found/1/frames/mono/000003.png"));
  EXPECT_TRUE(fs::exists(path / "lost+found/1/frames.csv"));
}

TEST(SessionCheck, SetsAPictureOfNoLineAside) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  fs::copy_file(path / "frames/mono/000002.png", path / "frames/mono/000077.png");
  EXPECT_THAT(examine_session(path, describe_rig).losses, ElementsAre("frames: 1 picture of no line in frames.csv"));
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  EXPECT_TRUE(fs::exists(path / "lost+found/1/frames/mono/000077.png"));
}

TEST(SessionCheck, NamesAFileThatNobodySealed) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  folder.write("s/notes.txt", "later");
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_THAT(found.extra, ElementsAre("notes.txt: not listed in SHA256SUMS"));
  EXPECT_THAT(found.losses, IsEmpty()) << "more than the recording, not less";
  EXPECT_FALSE(found.whole());
}

TEST(SessionCheck, CallsNothingLostThatIsMadeOfARecordingAndCanBeMadeAgain) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  folder.write("s/clouds/laser.ply", "another cloud");
  folder.write("s/clouds/stereo.ply", "a cloud made by a program that was killed before it sealed");
  folder.write("s/report.html", "its report");
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_THAT(found.losses, IsEmpty());
  EXPECT_THAT(found.undone, ElementsAre("clouds/stereo.ply: made from the recording after sealing; not sealed yet",
                                        StartsWith("report.html: made from the recording"),
                                        StartsWith("clouds/laser.ply: not as sealed")));
  EXPECT_TRUE(recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}}).finished);
  expect_mended(path);
  const SessionInfo info = Session::open(path).info;
  EXPECT_EQ(info.status, "complete");
  EXPECT_THAT(info.recovered, IsEmpty());
}

TEST(SessionCheck, SaysWhatIsMissingWhereNothingIsUsable) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  fs::remove(path / "session.yaml");
  fs::remove(path / "rig.yaml");
  EXPECT_THAT(examine_session(path, describe_rig).missing(),
              ElementsAre("cameras and calibration, which neither session.yaml nor rig.yaml tells"));
  fs::create_directory(folder.path() / "empty");
  EXPECT_THAT(examine_session(folder.path() / "empty", describe_rig).missing(),
              ElementsAre(StartsWith("cameras"), StartsWith("a frame with its picture, or a joint sample")));
}

TEST(SessionCheck, KnowsASealThatIsMissingFromADamageOfTheRecording) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  fs::remove(path / "SHA256SUMS");
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_THAT(found.losses, IsEmpty());
  EXPECT_THAT(found.undone, ElementsAre(HasSubstr("never sealed")));
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  EXPECT_EQ(Session::open(path).info.status, "complete") << "nothing was lost";
}

TEST(SessionCheck, HasNothingToUseInAnEmptyFolderOrABareHeader) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "empty");
  EXPECT_FALSE(examine_session(folder.path() / "empty", describe_rig).usable());
  { SessionWriter writer(folder.path() / "bare", some_info()); }
  fs::remove(folder.path() / "bare/session.yaml");
  EXPECT_FALSE(examine_session(folder.path() / "bare", describe_rig).usable());
  const Recovery done = recover_session(folder.path() / "bare", {.out = {}, .describe = describe_rig, .pictures = {}});
  EXPECT_FALSE(done.finished);
  EXPECT_FALSE(fs::exists(folder.path() / "bare/lost+found"));
  EXPECT_THAT(message_of<InputError>([&] { examine_session(folder.path() / "none", describe_rig); }),
              HasSubstr("none: is not a folder, expected a session"));
}

TEST(SessionRecover, MakesPicturesOfTheSpoolOfAKilledRecording) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = killed(folder);
  const SessionFindings found = examine_session(path, describe_rig);
  EXPECT_EQ(found.spooled, static_cast<std::size_t>(kFrames));
  EXPECT_THAT(found.losses, Contains("session.yaml: the recording never reached its end"));
  EXPECT_THAT(found.losses, Contains("joints.csv: ends 0.235 s after its first line; what came later is lost"));
  EXPECT_TRUE(recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}}).finished);
  expect_mended(path);
  const Session session = Session::open(path);
  EXPECT_EQ(session.frames.size(), static_cast<std::size_t>(kFrames));
  EXPECT_THAT(session.info.status, StartsWith("stopped: recovered"));
  EXPECT_EQ(session.info.lux_before, some_info().lux_before);
}

TEST(SessionRecover, TakesAFrameOfTheSpoolThatItsTableHadNoTimeFor) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = killed(folder);
  std::string frames = folder.read("s/frames.csv");
  frames.resize(frames.find("mono,3,"));
  folder.write("s/frames.csv", frames);
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  EXPECT_EQ(Session::open(path).frames.size(), static_cast<std::size_t>(kFrames));
}

TEST(SessionRecover, FinishesWhatAStopWhileWritingPicturesLeft) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const auto stop = [] { return true; };
  SessionWriter writer(folder.path() / "s", some_info());
  record(writer, kFrames);
  fs::create_directories(folder.path() / "s");
  writer.add_text("box.obj", "v 0 0 0\n");
  writer.close("complete", {{}, stop});
  write_checksums(folder.path() / "s");
  EXPECT_FALSE(fs::exists(folder.path() / "s/SHA256SUMS")) << "not finished, not sealed";
  EXPECT_THAT(message_of<InputError>([&] { recover_session(folder.path() / "s", {}); }),
              HasSubstr("by another process"));
  const fs::path path = folder.path() / "copy";
  fs::copy(folder.path() / "s", path, fs::copy_options::recursive);
  EXPECT_THAT(Session::open(path).warnings, Contains(HasSubstr("tankrig session recover")));
  const SessionFindings found = examine_session(path, {});
  EXPECT_THAT(found.losses, ElementsAre("rig.yaml: missing"));
  EXPECT_FALSE(recover_session(path, {.out = {}, .describe = {}, .pictures = {{}, stop}}).finished);
  EXPECT_TRUE(recover_session(path, {}).finished);
  expect_mended(path);
}

TEST(SessionRecover, LeavesTheOriginalAsItIsWithAnOut) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = killed(folder), out = folder.path() / "new/place";
  const std::vector<std::string> before = files_of(path);
  EXPECT_EQ(recover_session(path, {.out = out, .describe = describe_rig, .pictures = {}}).session, out);
  expect_mended(out);
  EXPECT_EQ(files_of(path), before);
  EXPECT_THAT(
      message_of<InputError>([&] { recover_session(path, {.out = out, .describe = describe_rig, .pictures = {}}); }),
      HasSubstr("exists already"));
}

TEST(SessionRecover, LeavesNoHalfCopy) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = killed(folder), out = folder.path() / "place/new";
  ASSERT_EQ(mkfifo((path / "zz").c_str(), 0600), 0) << "what fs::copy refuses";
  EXPECT_THAT(
      message_of<InputError>([&] { recover_session(path, {.out = out, .describe = describe_rig, .pictures = {}}); }),
      HasSubstr("cannot be copied to " + out.string()));
  EXPECT_TRUE(fs::is_empty(folder.path() / "place"));
}

TEST(SessionRecover, RefusesACopyInsideTheSession) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = killed(folder);
  const std::vector<std::string> before = files_of(path);
  EXPECT_THAT(message_of<InputError>(
                  [&] { recover_session(path, {.out = path / "copy", .describe = describe_rig, .pictures = {}}); }),
              HasSubstr("copy: lies in the session"));
  EXPECT_EQ(files_of(path), before);
}

TEST(SessionRecover, DoesNotSealWhatCannotBeOpened) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  fs::remove(path / "session.yaml");
  const DescribeRig beyond_range = [](const fs::path& rig, SessionInfo& info) {
    describe_rig(rig, info);
    info.cameras[0].model.fx = -1;  // written, and refused by every reader
  };
  EXPECT_THAT(
      message_of<InputError>([&] { recover_session(path, {.out = {}, .describe = beyond_range, .pictures = {}}); }),
      HasSubstr("fx_px"));
  EXPECT_FALSE(fs::exists(path / "SHA256SUMS"));
}

TEST(SessionRecover, ProvesTheCalibrationOfALostSessionYamlByItsHash) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  std::string yaml = folder.read("s/session.yaml");
  folder.write("s/session.yaml", yaml.substr(0, yaml.find("\ncameras:") + 40));
  EXPECT_THAT(examine_session(path, describe_rig).losses,
              ElementsAre(AllOf(StartsWith("session.yaml: cannot be read"), HasSubstr("its SHA-256 is right"))));
  EXPECT_FALSE(examine_session(path, {}).usable()) << "without the rig's calibration";
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  const SessionInfo info = Session::open(path).info, expected = some_info();
  EXPECT_EQ(info.operator_name, expected.operator_name);
  EXPECT_EQ(info.notes, expected.notes);
  EXPECT_EQ(info.seed, expected.seed);
  EXPECT_EQ(info.light, expected.light);
  EXPECT_EQ(info.lux_before, expected.lux_before);
  EXPECT_EQ(info.cameras[0].model.fx, kSmall.fx);
}

TEST(SessionRecover, RestoresAnEditedCalibrationFromTheRigThatHasItsHash) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = finished(folder);
  std::string yaml = folder.read("s/session.yaml");
  yaml.replace(yaml.find("k1: -0.37"), 9, "k1: -0.38");
  folder.write("s/session.yaml", yaml);
  recover_session(path, {.out = {}, .describe = describe_rig, .pictures = {}});
  expect_mended(path);
  EXPECT_EQ(Session::open(path).info.cameras[0].model.k1, kSmall.k1);
}

}  // namespace
}  // namespace tankrig
