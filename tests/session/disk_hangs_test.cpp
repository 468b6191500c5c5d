// A recorder whose disk does not come back, and one that has no threads: it ends, says so, and leaves what is there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>
#include <optional>
#include <thread>

#include "session/checking/session_recover.hpp"
#include "session/recording/spool.hpp"
#include "tests/session/disk_door.hpp"
#include "tests/session/in_child.hpp"
#include "tests/session/some_session.hpp"
#include "tests/support/few_threads.hpp"
#include "tests/support/held_thread.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::DiskDoor;
using testing_support::HeldThread;

bool within(Duration patience, const std::function<bool()>& done) {
  for (const auto end = std::chrono::steady_clock::now() + patience; std::chrono::steady_clock::now() < end;
       std::this_thread::sleep_for(5ms))
    if (done()) return true;
  return false;
}

std::size_t lines_of(const fs::path& file) {
  std::ifstream in(file);
  return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
}

bool refused(const std::function<void()>& action) {
  try {
    action();
    return false;
  } catch (const InputError&) {
    return true;
  }
}

bool at_rest(const fs::path& session) {
  return !refused([&] { const SessionLock lock(session); });
}

/// Frames 0 to 4, on the disk with their lines.
void begin(SessionWriter& writer) {
  for (int i = 0; i < 5; ++i) writer.frame(some_frame(i), test_image(i));
  ASSERT_TRUE(within(30s, [&] { return lines_of(writer.path() / "frames.csv") == 6; }));
}

void expect_recoverable(const fs::path& path) {
  const SessionFindings found = examine_session(path, {});
  EXPECT_TRUE(found.usable());
  EXPECT_FALSE(found.whole());
  EXPECT_EQ(found.info.status, "recording");
  EXPECT_GE(found.frames.records.size(), 5u);
}

TEST(DiskThatHangs, InAWriteIsLeftBehindAndWhatIsOnItIsKept) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "s";
  {
    std::optional<SessionWriter> writer;
    writer.emplace(path, bare_info(), SessionWriterOptions{.wait_when_full = false, .patience = {.write = 1s}});
    begin(*writer);
    const HeldThread held("disk-writer");
    ASSERT_TRUE(held.found());
    EXPECT_TRUE(within(
        30s, [&] { return !message_of<InputError>([&] { writer->frame(some_frame(5), test_image(5)); }).empty(); }));
    EXPECT_THAT(message_of<DiskHangs>([&] { writer->close("complete"); }), HasSubstr("does not answer"));
    writer.reset();
    expect_recoverable(path);
    EXPECT_THAT(message_of<InputError>([&] { recover_session(path, {}); }), HasSubstr("is being written"))
        << "the thread may come back at any time";
  }
  ASSERT_TRUE(within(30s, [&] { return at_rest(path); }));
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_TRUE(examine_session(path, {}).whole());
  EXPECT_GE(Session::open(path).frames.size(), 5u);
}

TEST(DiskThatHangs, InASyncIsLeftBehindToo) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "s";
  {
    DiskDoor door(folder.path());
    SessionWriter writer(path, bare_info(), {.wait_when_full = false, .patience = {.sync = 3s}});
    begin(writer);
    door.hold();
    ASSERT_TRUE(within(30s, [&] { return door.someone_waits(); }));
    writer.frame(some_frame(5), test_image(5));  // the disk takes what it is given
    EXPECT_THAT(message_of<DiskHangs>([&] { writer.close("complete"); }), HasSubstr("does not answer"));
    expect_recoverable(path);
  }
  ASSERT_TRUE(within(30s, [&] { return at_rest(path); }));
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_EQ(Session::open(path).frames.size(), 6u);
}

TEST(DiskThatHangs, IsNoticedByARecorderThatWaitsForIt) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", bare_info(),
                       {.wait_when_full = true, .ring_bytes = 1, .patience = {.write = 1s}});
  begin(writer);
  const HeldThread held("disk-writer");
  ASSERT_TRUE(held.found());
  EXPECT_THAT(message_of<InputError>([&] {
                for (int i = 5; i < 100; ++i) writer.frame(some_frame(i), test_image(i));
              }),
              HasSubstr("does not answer"));
  EXPECT_THAT(message_of<DiskHangs>([&] { writer.close("complete"); }), HasSubstr("does not answer"));
}

TEST(DiskSync, ThatFailsEndsTheRecordingAndIsNamed) {
  const TemporaryFolder folder;
  DiskDoor door(folder.path());
  SessionWriter writer(folder.path() / "s", bare_info(), {.wait_when_full = false});
  begin(writer);
  door.refuse(EIO);
  EXPECT_TRUE(within(30s, [&] { return refused([&] { writer.joints(some_joints(0)); }); }));
  door.refuse(0);
  EXPECT_THAT(message_of<NotOnDisk>([&] { writer.close("complete"); }), HasSubstr("Input/output error"));
  EXPECT_THAT(Session::open(writer.path()).info.status, HasSubstr("Input/output error"));
  EXPECT_TRUE(has_spool(writer.path())) << "a sync that succeeds later proves nothing";
}

TEST(Recorder, ThatGetsNoneOrOneOfItsThreadsSaysSo) {
  TANKRIG_SKIP_SANITIZED("it has memory of its own, so a limit of this one stops it elsewhere");
  for (const std::size_t threads : {0, 1}) {
    const TemporaryFolder folder;
    in_child([&] {
      ASSERT_TRUE(testing_support::allow_threads(threads));
      EXPECT_THAT(message_of<InputError>([&] { SessionWriter(folder.path() / "s", bare_info()); }),
                  HasSubstr("no thread to write it"));
      EXPECT_TRUE(at_rest(folder.path() / "s")) << "none is left";
    });
  }
}

}  // namespace
}  // namespace tankrig
