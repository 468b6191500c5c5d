// A disk that refuses any one step of a recording: it is told, what was handed over is kept, and what is called done is
// on the disk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>

#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "session/recording/spool.hpp"
#include "tests/session/disk_door.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing_support::DiskDoor;
using Fails = DiskDoor::Fails;

constexpr std::size_t kRecorded = 3;

struct Recorded {
  bool handed_over = false;   ///< everything, before anything went wrong
  std::uint64_t refused = 0;  ///< frames of these that the disk would not take, and that are counted so
  std::string error;          ///< empty: none
};

/// Records, closes and seals, as a scan does.
Recorded record_and_seal(const fs::path& path) {
  Recorded out;
  try {
    SessionWriter writer(path, bare_info());
    writer.add_text("plan.csv", "a plan\n");
    record(writer, kRecorded);
    out.handed_over = true;
    try {
      writer.close("complete");
    } catch (const InputError&) {
      out.refused = writer.info().counts["mono." + std::string(SessionWriter::kDroppedByDisk)];
      throw;
    }
    write_checksums(path);
  } catch (const InputError& e) {
    out.error = e.what();
  }
  return out;
}

std::size_t frames_of(const fs::path& path) { return examine_session(path, {}).frames.records.size(); }

TEST(PowerCut, AfterTheSessionWasSealedTakesNothing) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const DiskDoor door(folder.path());
  EXPECT_EQ(record_and_seal(folder.path() / "s").error, "");
  leave_on_disk(door, folder.path() / "s", folder.path() / "cut");
  const SessionFindings found = examine_session(folder.path() / "cut", {});
  EXPECT_THAT(found.losses, IsEmpty());
  EXPECT_THAT(found.undone, IsEmpty());
  EXPECT_EQ(found.frames.records.size(), kRecorded);
}

TEST(PowerCut, AfterTheRecordingEndedTakesNoLine) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const DiskDoor door(folder.path());
  SessionWriter writer(folder.path() / "s", bare_info());
  for (int i = 0; i < 100; ++i) writer.joints(some_joints(i));
  writer.close("complete");
  const auto left = door.on_disk(folder.path() / "s");
  ASSERT_TRUE(left.contains("joints.csv"));
  EXPECT_EQ(left.at("joints.csv"), folder.read("s/joints.csv"));
  EXPECT_THAT(left.at("session.yaml"), HasSubstr("status: \"complete\""));
}

/// What holds of a recording that lost one step, or all from one step on.
void expect_told_and_kept(const TemporaryFolder& folder, DiskDoor& door, const Recorded& recorded) {
  const fs::path path = folder.path() / "s", cut = folder.path() / "cut";
  EXPECT_NE(recorded.error, "") << "nobody was told";
  if (!fs::exists(path / "session.yaml")) return;
  if (recorded.handed_over) {
    EXPECT_EQ(frames_of(path), kRecorded - recorded.refused);
    for (const char* written_last : {".png", "session.yaml", "SHA256SUMS"})
      if (door.failed().find(written_last) != std::string::npos) {
        EXPECT_EQ(recorded.refused, 0u) << "all were in the spool";
      }
  }
  if (spool_segments(path).empty() && recorded.handed_over) {
    const auto left = door.on_disk(path);
    std::error_code none;
    for (const auto& picture : fs::recursive_directory_iterator(path / "frames", none))
      if (picture.is_regular_file()) {
        const std::string name = picture.path().lexically_relative(path).generic_string();
        ASSERT_TRUE(left.contains(name)) << "removed from the spool before its picture was on the disk";
        EXPECT_EQ(left.at(name), folder.read("s/" + name));
      }
  }
  if (!examine_session(path, {}).usable()) return;
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_TRUE(examine_session(path, {}).whole());
  leave_on_disk(door, path, cut);
  EXPECT_TRUE(examine_session(cut, {}).whole()) << "recovered, and not on the disk";
}

void fail_at_every_step(int error, Fails how) {
  const InMemory in_memory;
  int step = 0;
  for (bool reached = true; reached && !testing::Test::HasFailure(); ++step) {
    const TemporaryFolder folder;
    DiskDoor door(folder.path());
    door.fail(step, error, how);
    const Recorded recorded = record_and_seal(folder.path() / "s");
    door.fail(-1, 0, Fails::kNever);
    reached = !door.failed().empty();
    SCOPED_TRACE("step " + std::to_string(step) + ", " + door.failed() + ": " + recorded.error);
    if (reached)
      expect_told_and_kept(folder, door, recorded);
    else
      EXPECT_EQ(recorded.error, "");
  }
  std::printf("%d steps, each failed with \"%s\"%s\n", step - 1, std::strerror(error),
              how == Fails::kOnce ? " once" : " and all after it");
  EXPECT_GT(step, 30);
}

TEST(FailingDisk, OnceAtAnyStepIsToldAndLosesNoFrame) { fail_at_every_step(EIO, Fails::kOnce); }
TEST(FailingDisk, FromAnyStepOnIsToldAndLosesNoFrame) { fail_at_every_step(EIO, Fails::kFromThenOn); }
TEST(FailingDisk, FullOnceAtAnyStepIsToldAndLosesNoFrame) { fail_at_every_step(ENOSPC, Fails::kOnce); }
TEST(FailingDisk, FullFromAnyStepOnIsToldAndLosesNoFrame) { fail_at_every_step(ENOSPC, Fails::kFromThenOn); }

TEST(FailingDisk, KeepsTheSpoolOfPicturesThatCouldNotBeSynced) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "s";
  DiskDoor door(folder.path());
  {
    SessionWriter writer(path, bare_info());
    record(writer, kRecorded);
    const PictureOptions pictures{[&](double) { door.refuse(EIO); }, {}};
    EXPECT_THAT(message_of<NotOnDisk>([&] { writer.close("complete", pictures); }),
                HasSubstr("cannot be brought to the disk: Input/output error"));
  }
  EXPECT_FALSE(spool_segments(path).empty());
  door.refuse(0);
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_EQ(Session::open(path).frames.size(), kRecorded);
}

/// As a kill leaves it: frames in the spool, no end, no seal.
fs::path stopped_before_the_pictures(const TemporaryFolder& folder) {
  const fs::path live = folder.path() / "live", path = folder.path() / "s";
  SessionWriter writer(live, bare_info());
  record(writer, kRecorded);
  writer.close("complete", {{}, [] { return true; }});
  fs::copy(live, path, fs::copy_options::recursive);
  return path;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

TEST(RecoveredCopy, ThatFailsAtAnyStepLeavesNothingBehind) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = stopped_before_the_pictures(folder), place = folder.path() / "place";
  fs::create_directory(place);
  ASSERT_TRUE(has_spool(path));
  bool reached = true;
  int step = 0;
  for (; reached && !testing::Test::HasFailure(); ++step) {
    DiskDoor door(folder.path());
    door.fail(step, ENOSPC, Fails::kOnce);
    const std::string said =
        message_of<InputError>([&] { recover_session(path, {.out = place / "copy", .describe = {}, .pictures = {}}); });
    reached = said != "no error";
    SCOPED_TRACE("step " + std::to_string(step) + ", " + door.failed() + ": " + said);
    if (reached) {
      EXPECT_THAT(names_in(place), IsEmpty());
    } else {
      EXPECT_THAT(names_in(place), testing::ElementsAre("copy"));
      EXPECT_TRUE(examine_session(place / "copy", {}).whole());
    }
  }
  EXPECT_GT(step, 10) << "as many failed, and one more failed nothing";
}

TEST(RecoveredCopy, OfNothingUsableOrStoppedLeavesNothingBehind) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path path = stopped_before_the_pictures(folder), place = folder.path() / "place",
                 empty = folder.path() / "empty";
  fs::create_directory(place);
  fs::create_directory(empty);
  Recovery done = recover_session(path, {place / "copy", {}, {{}, [] { return true; }}});
  EXPECT_FALSE(done.finished);
  EXPECT_EQ(done.session, path);
  done = recover_session(empty, {place / "copy", {}, {}});
  EXPECT_FALSE(done.finished);
  EXPECT_THAT(names_in(place), IsEmpty());
}

TEST(DurableFile, IsOldOrNewWhateverStepOfItsWritingFails) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.yaml";
  DiskDoor door(folder.path());
  bool reached = true;
  for (int step = 0; reached; ++step) {
    write_file_durably(file, "old");
    door.fail(step, EIO, Fails::kOnce);
    const std::string said = message_of<CannotWrite>([&] { write_file_durably(file, "new"); });
    reached = said != "no error";
    SCOPED_TRACE("step " + std::to_string(step) + ": " + said);
    door.fail(-1, 0, Fails::kNever);
    const std::string text = folder.read("a.yaml");
    EXPECT_TRUE(text == "new" || (reached && text == "old")) << text;
    EXPECT_FALSE(fs::exists(file.string() + kUnfinished));
    if (reached) {
      EXPECT_THAT(said, HasSubstr(folder.path().string()));
    } else {
      EXPECT_GE(step, 5) << "opened, written, synced, renamed, its folder opened and synced";
      EXPECT_EQ(door.on_disk(folder.path()).at("a.yaml"), "new");
    }
  }
}

}  // namespace
}  // namespace tankrig
