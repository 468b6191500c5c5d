// The recorder under load, on a disk that fills up, and on one that refuses: it keeps up, or says what it lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <numeric>
#include <thread>

#include "core/input_error.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "tests/session/in_child.hpp"
#include "tests/session/some_session.hpp"
#include "tests/support/held_thread.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::StartsWith;

constexpr int kWidth = 640, kHeight = 480;

SessionInfo three_cameras() {
  SessionInfo info = some_info();
  info.cameras.clear();
  info.object.reset();
  info.rig_hash.clear();
  const std::array roles{CameraRole::kMono, CameraRole::kLeft, CameraRole::kRight};
  for (const CameraRole role : roles) {
    CalibratedCamera camera{to_string(role), role, kSmall, Transform::Identity()};
    camera.model.width = kWidth, camera.model.height = kHeight;
    info.cameras.push_back(camera);
  }
  return info;
}

/// A picture with the noise of a sensor: it does not compress well.
cv::Mat noisy_picture(int seed) {
  cv::Mat image(kHeight, kWidth, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(image, cv::RNG::NORMAL, 90, 6);
  return image;
}

FrameRecord frame_of(const std::string& camera, int index) {
  FrameRecord frame = some_frame(index);
  frame.camera = camera;
  return frame;
}

/// Frames until the recorder says no. What it said.
std::string record_until_refused(SessionWriter& writer, int frames) {
  return message_of<InputError>([&] {
    for (int i = 0; i < frames; ++i) {
      writer.joints(some_joints(i));
      writer.frame(frame_of("mono", i), noisy_picture(i));
      std::this_thread::sleep_for(1ms);
    }
  });
}

TEST(Recorder, SustainsThreeColourCamerasAt25FramesPerSecond) {
  constexpr int kFrames = 100;  // 4 s of 69 MB/s: the ring holds 0.7 s of them
  constexpr auto kPeriod = 40ms * testing_support::kSlowness;
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", three_cameras(), {.wait_when_full = false, .ring_bytes = 48 << 20});
  const cv::Mat picture = noisy_picture(0);
  const testing_support::MachineWitness witness;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kFrames; ++i) {
    std::this_thread::sleep_until(begin + i * kPeriod);
    for (int j = 0; j < 8; ++j) writer.joints(some_joints(i * 8 + j));
    for (const char* camera : {"mono", "left", "right"}) writer.frame(frame_of(camera, i), picture);
  }
  writer.close("complete");
  for (const std::string camera : {"mono.", "left.", "right."}) {
    std::uint64_t accounted = 0;
    for (const auto& [reason, count] : writer.info().counts)
      if (reason.starts_with(camera)) accounted += count;
    EXPECT_EQ(accounted, static_cast<std::uint64_t>(kFrames)) << camera;
  }
  write_checksums(folder.path() / "s");
  const SessionFindings found = examine_session(folder.path() / "s", {});
  EXPECT_TRUE(found.whole());
  TANKRIG_SKIP_IF_LATE(witness, 100ms * testing_support::kSlowness);
  EXPECT_EQ(found.frames.records.size(), 3u * kFrames);
  for (const auto& [reason, count] : found.info.counts) {
    EXPECT_THAT(reason, testing::Not(HasSubstr("dropped"))) << count;
    if (reason.ends_with(".recorded")) {
      EXPECT_EQ(count, static_cast<std::uint64_t>(kFrames)) << reason;
    }
  }
}

TEST(Recorder, EndsWhereTheDiskDoesNotComeBackFromAWrite) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", three_cameras(), {.wait_when_full = false, .patience = {.write = 1s}});
  writer.frame(frame_of("mono", 0), noisy_picture(0));
  std::string said;
  {
    const testing_support::HeldThread held("disk-writer");
    ASSERT_TRUE(held.found());
    said = record_until_refused(writer, 2000);
  }
  EXPECT_THAT(said, HasSubstr("the disk does not answer"));
  EXPECT_THAT(message_of<InputError>([&] { writer.close("complete"); }), HasSubstr("the disk does not answer"));
  EXPECT_THAT(examine_session(folder.path() / "s", {}).info.status, HasSubstr("the disk does not answer"));
}

TEST(Recorder, CutsATornFrameOffAgainWhenAWriteFails) {
  const TemporaryFolder folder;
  in_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit five_megabytes{5'000'000,
                                5'000'000};  // no file may be larger: a write is cut in the middle of a frame
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &five_megabytes), 0);
    SessionWriter writer(folder.path() / "s", three_cameras(), {.wait_when_full = false});
    EXPECT_THAT(record_until_refused(writer, 2000), HasSubstr("spool/000000.raw: cannot be written: File too large"));
    EXPECT_THAT(message_of<InputError>([&] { writer.close("stopped: asked for"); }), HasSubstr("File too large"));
    EXPECT_GE(writer.info().counts["mono.dropped_disk"], 1u);
  });
  const fs::path path = folder.path() / "s";
  const SessionFindings found = examine_session(path, {});
  EXPECT_EQ(found.frames.records.size(), 5u) << "five of 0.9 MB fit into 5 MB";
  EXPECT_THAT(found.info.status, StartsWith("stopped: ")) << "and the session says why";
  EXPECT_THAT(found.info.status, HasSubstr("File too large"));
  EXPECT_THAT(found.losses, testing::IsEmpty()) << "what was not written is in its counts";
  EXPECT_TRUE(recover_session(path, {}).finished);
  EXPECT_TRUE(examine_session(path, {}).whole());
}

/// A private file system of `bytes` at `path`, for this process and those it starts. What forbids it, or nothing.
std::string mount_small_disk(const fs::path& path, const std::string& bytes) {
  const auto user = ::getuid(), group = ::getgid();
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return std::string("unshare: ") + std::strerror(errno);
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
  std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  if (::mount("tmpfs", path.c_str(), "tmpfs", 0, ("size=" + bytes).c_str()) != 0)
    return std::string("mount: ") + std::strerror(errno);
  return {};
}

TEST(Recorder, LeavesAUsableSessionOnAFullDisk) {
  const TemporaryFolder folder;
  const fs::path disk = folder.path() / "disk", elsewhere = folder.path() / "recovered";
  fs::create_directory(disk);
  constexpr int kForbidden = 77;
  const int status = wait_for_child(start_child([&] {
    if (const std::string why = mount_small_disk(disk, "16m"); !why.empty()) {
      std::printf("no private disk: %s\n", why.c_str());
      std::fflush(nullptr);
      ::_exit(kForbidden);
    }
    const fs::path path = disk / "s";
    std::uint64_t refused = 0;
    {
      SessionWriter writer(path, three_cameras(), {.wait_when_full = false});
      EXPECT_THAT(record_until_refused(writer, 2000), HasSubstr("No space left on device"));
      EXPECT_THAT(message_of<InputError>([&] { writer.close("complete"); }), HasSubstr("No space left on device"));
      refused = writer.info().counts["mono.dropped_disk"];
    }
    EXPECT_GE(refused, 1u);
    const SessionFindings found = examine_session(path, {});
    EXPECT_GE(found.frames.records.size(), 10u) << "of 0.9 MB, on 12 MB";
    EXPECT_FALSE(found.whole());
    EXPECT_TRUE(found.usable());
    EXPECT_THAT(found.info.status, HasSubstr("No space left on device"));
    EXPECT_EQ(found.info.counts.at("mono.dropped_disk"), refused);
    EXPECT_EQ(found.info.counts.at("mono.recorded"), found.frames.records.size());
    EXPECT_TRUE(recover_session(path, {.out = elsewhere, .describe = {}, .pictures = {}}).finished);
    const Session session = Session::open(elsewhere);
    EXPECT_EQ(session.frames.size(), found.frames.records.size());
    for (const FrameRecord& frame : session.frames)
      EXPECT_EQ(cv::norm(session.image(frame), noisy_picture(frame.index), cv::NORM_INF), 0);
    EXPECT_TRUE(examine_session(elsewhere, {}).whole());
  }));
  if (WIFEXITED(status) && WEXITSTATUS(status) == kForbidden)
    GTEST_SKIP() << "a file system of one's own is not permitted here";
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(Recorder, RefusesToBeginOnAFullDisk) {
  const TemporaryFolder folder;
  in_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit one_megabyte{1'000'000, 1'000'000};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &one_megabyte), 0);
    EXPECT_THAT(message_of<InputError>([&] { SessionWriter(folder.path() / "s", three_cameras()); }),
                HasSubstr("spool/reserve: cannot be written"));
  });
}

}  // namespace
}  // namespace tankrig
