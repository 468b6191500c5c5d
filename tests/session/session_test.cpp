// A session written and read back: exactly, after a cut at any byte, and with every kind of damage named.
#include "session/reading/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "core/input_error.hpp"
#include "session/reading/session_summary.hpp"
#include "session/reading/session_tables.hpp"
#include "session/recording/session_writer.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::string error_of_opening(const fs::path& path) {
  return message_of<InputError>([&] { Session::open(path); });
}

TEST(Session, ReadsBackExactlyWhatWasWritten) {
  const TemporaryFolder folder;
  const Session session = Session::open(recorded(folder));
  EXPECT_TRUE(session.warnings.empty());
  const SessionInfo expected = some_info();
  const SessionInfo& info = session.info;
  EXPECT_EQ(info.name, "s");
  EXPECT_EQ(info.status, "complete");
  EXPECT_EQ(info.operator_name, expected.operator_name);
  EXPECT_EQ(info.notes, expected.notes);
  EXPECT_EQ(info.seed, expected.seed);
  EXPECT_EQ(info.light, expected.light);
  EXPECT_EQ(info.lux_before, expected.lux_before);
  EXPECT_FALSE(info.lux_after);
  EXPECT_EQ(info.simulated_s, expected.simulated_s);
  EXPECT_EQ(info.counts, (std::map<std::string, std::uint64_t>{{"not_recorded", 7}, {"mono.recorded", 5}}));
  EXPECT_EQ(info.tables.at("joints").lines, 40u);
  EXPECT_EQ(info.tables.at("joints").last, some_joints(39).stamp);
  ASSERT_EQ(info.cameras.size(), 1u);
  EXPECT_EQ(info.cameras[0].model.fx, kSmall.fx);
  EXPECT_EQ(info.cameras[0].model.fy, kSmall.fy);
  EXPECT_EQ(info.cameras[0].model.k3, kSmall.k3);
  EXPECT_TRUE(info.cameras[0].bMc.isApprox(expected.cameras[0].bMc, 1e-15));
  EXPECT_EQ(info.calibration.ePl->normal, expected.calibration.ePl->normal);
  EXPECT_EQ(info.calibration.ePl->offset, expected.calibration.ePl->offset);
  EXPECT_EQ(info.calibration.laser_origin_e, expected.calibration.laser_origin_e);
  EXPECT_EQ(info.calibration.laser_direction_e, expected.calibration.laser_direction_e);
  EXPECT_EQ(info.calibration.laser_fan, expected.calibration.laser_fan);
  EXPECT_EQ(info.calibration.arm->actuators[kElbow].m_per_tick, arm5e().actuators[kElbow].m_per_tick);
  EXPECT_EQ(info.calibration.arm->bMe(*some_frame(1).q).matrix(), arm5e().bMe(*some_frame(1).q).matrix());
  EXPECT_TRUE(info.object->bMo.isApprox(expected.object->bMo, 1e-15));

  ASSERT_EQ(session.frames.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const FrameRecord frame = some_frame(i), &read = session.frames[static_cast<std::size_t>(i)];
    EXPECT_EQ(read.sequence, frame.sequence);
    EXPECT_EQ(read.stamp, frame.stamp);
    EXPECT_EQ(read.stamp_sigma, frame.stamp_sigma);
    EXPECT_EQ(read.exposure, frame.exposure);
    EXPECT_EQ(read.phase, frame.phase);
    EXPECT_EQ(read.pass, frame.pass);
    EXPECT_EQ(read.laser_on, frame.laser_on);
    EXPECT_EQ(*read.q, *frame.q);
    EXPECT_EQ(read.sync_residual, frame.sync_residual);
    EXPECT_FALSE(read.cPl);
    EXPECT_EQ(read.file, "frames/mono/00000" + std::to_string(i) + ".png");
    EXPECT_EQ(cv::norm(session.image(read), test_image(i), cv::NORM_INF), 0);
  }
  const auto joints = read_joints_csv(session.path / "joints.csv");
  ASSERT_EQ(joints.records.size(), 40u);
  EXPECT_EQ(joints.records[17].q, some_joints(17).q);
  EXPECT_EQ(joints.records[17].velocity, some_joints(17).velocity);
  EXPECT_EQ(joints.records[17].ticks, some_joints(17).ticks);
  const auto events = read_events_csv(session.path / "events.csv");
  ASSERT_EQ(events.records.size(), 1u);
  EXPECT_EQ(events.records[0].text, "sweep, \"pass\" 0 begins");
}

TEST(Session, PlacesTheLaserByTheJointsOfTheFrame) {
  const TemporaryFolder folder;
  const Session session = Session::open(recorded(folder));
  const FrameRecord& frame = session.frames[3];
  const Plane cPl = session.laser_plane(frame);
  // A point of the sheet, taken round the other way.
  const Plane& ePl = *session.info.calibration.ePl;
  const Vector3d on_sheet_e = -ePl.offset * ePl.normal;
  const Vector3d on_sheet_c = session.info.cameras[0].bMc.inverse() * (arm5e().bMe(*frame.q) * on_sheet_e);
  EXPECT_NEAR(cPl.distance(on_sheet_c), 0, 1e-14);
  EXPECT_NEAR(cPl.normal.norm(), 1, 1e-14);
}

TEST(Session, IsNotOpenedWithALaserThatItsEndEffectorCannotCarry) {
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  std::string yaml = folder.read("s/session.yaml");
  const std::size_t at = yaml.find("offset_m: 0.09796");
  ASSERT_NE(at, std::string::npos);
  folder.write("s/session.yaml", yaml.replace(at, 17, "offset_m: 9.796"));
  EXPECT_THAT(error_of_opening(path), HasSubstr("ePl: found offset_m 9.796, farther from the end effector"));
}

TEST(Session, OpensWhileItIsRecordedAndSaysSo) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", some_info());
  const Session session = Session::open(folder.path() / "s");
  EXPECT_EQ(session.info.status, "recording");
  EXPECT_EQ(session.warnings, std::vector<std::string>{"the recording was cut short: it never reached its end"});
  writer.close("complete");
}

TEST(Session, HasItsFoldersNameHoweverThatIsWritten) {
  const TemporaryFolder folder;
  SessionInfo info = some_info();
  info.name.clear();
  SessionWriter((folder.path() / "monday" / "").string(), info).close("complete");
  EXPECT_EQ(Session::open(folder.path() / "monday").info.name, "monday");
}

TEST(Session, IsOnDiskSoonWithoutBeingClosed) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", some_info());
  for (int i = 0; i < 500; ++i) writer.joints(some_joints(i));
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::size_t found = 0;
  while (found < 500 && std::chrono::steady_clock::now() < give_up) {
    found = read_joints_csv(folder.path() / "s/joints.csv", true).records.size();
    std::this_thread::yield();
  }
  EXPECT_EQ(found, 500u);
}

TEST(Session, KeepsEveryWholeLineWhenATableIsCutAtAnyByte) {
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  const std::string whole = folder.read("s/joints.csv");
  const std::size_t begin = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t bytes = begin; bytes < whole.size(); ++bytes) {
    const auto table = read_joints_csv(folder.write("s/joints.csv", whole.substr(0, bytes)));
    EXPECT_EQ(table.cut_short, bytes != begin);
    EXPECT_EQ(table.records.size(), 39u);
  }
  folder.write("s/frames.csv", folder.read("s/frames.csv") + "mono,5,10");
  const Session session = Session::open(path);
  EXPECT_EQ(session.frames.size(), 5u);
  EXPECT_EQ(session.warnings, std::vector<std::string>{"frames.csv: its last line is incomplete and left out"});
}

TEST(Session, RefusesATableWithoutItsHeaderOnceTheRecordingIsOver) {
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  const std::string expected = "expected the header " + frames_header().substr(0, frames_header().size() - 1);
  for (const std::string text : {"", "camera,ind", "mono"}) {
    folder.write("s/frames.csv", text);
    EXPECT_THAT(error_of_opening(path), AllOf(HasSubstr("frames.csv:1: found "), HasSubstr(expected))) << text;
  }
  EXPECT_THAT(message_of<InputError>([&] { read_joints_csv(folder.write("joints.csv", "")); }),
              HasSubstr("joints.csv:1: found nothing, expected the header stamp_ns,"));
  EXPECT_THAT(message_of<InputError>([&] { read_events_csv(folder.write("events.csv", "")); }),
              HasSubstr("events.csv:1: found nothing, expected the header stamp_ns,kind,text"));
}

TEST(Session, OpensARecordingCutInAHeader) {
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  std::string yaml = folder.read("s/session.yaml");
  folder.write("s/session.yaml", yaml.replace(yaml.find("complete"), 8, "recording"));
  for (const std::string text : {"", "camera,ind"}) {
    folder.write("s/frames.csv", text);
    const Session session = Session::open(path);
    EXPECT_TRUE(session.frames.empty());
    EXPECT_THAT(session.warnings, testing::Contains(HasSubstr("frames.csv: ")));
    EXPECT_TRUE(read_joints_csv(folder.write("joints.csv", ""), true).cut_short);
    EXPECT_TRUE(read_events_csv(folder.write("events.csv", ""), true).cut_short);
  }
  folder.write("s/frames.csv", "mono");
  EXPECT_THAT(error_of_opening(path), HasSubstr("frames.csv:1: found 'mono' without a line end, expected the header"));
}

TEST(Session, LeavesOutFramesWhoseImageACutRecordingNeverWrote) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", some_info());
  record(writer, 5);
  writer.close("recording");
  fs::remove(folder.path() / "s/frames/mono/000004.png");
  const Session session = Session::open(folder.path() / "s");
  EXPECT_EQ(session.frames.size(), 4u);
  EXPECT_THAT(session.warnings, testing::Contains("1 frames of 5 in frames.csv have no image and are left out"));
}

TEST(Session, SaysThatItsCalibrationWasEdited) {
  const TemporaryFolder folder;
  const fs::path path = recorded(folder);
  std::string yaml = folder.read("s/session.yaml");
  yaml.replace(yaml.find("k1: -0.37"), 9, "k1: -0.38");
  folder.write("s/session.yaml", yaml);
  EXPECT_THAT(Session::open(path).warnings, testing::ElementsAre(HasSubstr("calibration in session.yaml was changed")));
}

TEST(Session, NamesWhatIsMissing) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_of_opening(folder.path() / "none"), HasSubstr("none: is not a folder, expected a session"));
  EXPECT_THAT(error_of_opening(folder.path()), HasSubstr("has no session.yaml"));
  const fs::path path = recorded(folder);
  const Session session = Session::open(path);
  EXPECT_THAT(message_of<InputError>([&] { session.camera(CameraRole::kLeft); }), HasSubstr("found no left camera"));
  fs::remove(path / "frames/mono/000002.png");
  EXPECT_THAT(message_of<InputError>([&] { session.image(session.frames[2]); }),
              HasSubstr("000002.png: does not exist, expected the image of a frame of frames.csv; a session of what is "
                        "left: tankrig session recover " +
                        path.string()));
  folder.write("s/frames/mono/000003.png", "not a picture");
  EXPECT_THAT(message_of<InputError>([&] { session.image(session.frames[3]); }),
              HasSubstr("000003.png: cannot be decoded"));
  cv::imwrite((path / "frames/mono/000001.png").string(), cv::Mat::zeros(3, 4, CV_8UC3));
  EXPECT_THAT(message_of<InputError>([&] { session.image(session.frames[1]); }),
              HasSubstr("found 4 x 3 px, expected 8 x 6"));
  fs::remove(path / "frames.csv");
  EXPECT_THAT(error_of_opening(path), HasSubstr("frames.csv: cannot be read"));
}

struct Damage {
  const char *file, *find, *replace, *message;
};

TEST(Session, NamesFileLineAndFieldOfBadInput) {
  const Damage damages[] = {
      {"session.yaml", "kind: \"scan\"", "kind: \"film\"",
       "session.yaml:4: kind: found 'film', expected one of: scan, import"},
      {"session.yaml", "format: tankrig-session 1", "format: tankrig-session 9",
       "session.yaml:1: format: found 'tankrig-session 9'"},
      {"session.yaml", "seed: ", "seeds: ", "seed: "},
      {"session.yaml", "seed: 1", "seed: -1", "seed: found '-1"},
      {"session.yaml", "light: 0.3", "light: 7.3", "light: found '7.3"},
      {"session.yaml", "fx_px: 10.1", "fx_px: ten", "fx_px: found 'ten"},
      {"session.yaml", "fx_px: 10.1", "fx_px: 200000.1", "fx_px: found '200000.1"},
      {"session.yaml", "cy_px: 2.5", "cy_px: -20000", "cy_px: found '-20000', expected a number from -10000 to 100000"},
      {"session.yaml", "k1: -0.37", "k1: -370", "k1: found '-370', expected a number from -100 to 100"},
      {"session.yaml", "p2: 0.0029", "p2: 29", "p2: found '29', expected a number from -10 to 10"},
      {"session.yaml", "role: mono", "role: third", "role: found 'third', expected one of: mono, left, right"},
      {"session.yaml", "name: \"s\"", "name: \"s\"\nsurprise: 1", "session.yaml:3: surprise: unknown key"},
      {"frames.csv", "camera,index", "camera,number", "frames.csv:1: column 2: found 'number', expected 'index'"},
      {"frames.csv", "mono,2,", "mono,two,", "frames.csv:4: index: found 'two', expected a whole number"},
      {"frames.csv", "mono,2,", "mono,-2,", "frames.csv:4: index: found '-2', expected a whole number of at least 0"},
      {"frames.csv", "frames/mono/000002.png", "rig.yaml",
       "frames.csv:4: file: found 'rig.yaml', expected a picture below frames/mono/"},
      {"frames.csv", "mono,2,", "mono,", "frames.csv:4: found 20 fields, expected 21"},
      {"frames.csv", ",sweep,1,", ",swoop,1,",
       "frames.csv:3: phase: found 'swoop', expected move, dark_before, sweep or dark_after"},
      {"frames.csv", ",0.12,", ",nan,", "frames.csv:2: q_shoulder_rad: found 'nan', expected a number"},
      {"frames.csv", ",sweep,1,1,", ",sweep,1,yes,", "frames.csv:3: laser_on: found 'yes', expected 0 or 1"},
  };
  for (const Damage& damage : damages) {
    const TemporaryFolder folder;
    const fs::path path = recorded(folder);
    const std::string name = std::string("s/") + damage.file;
    std::string text = folder.read(name);
    const std::size_t at = text.find(damage.find);
    ASSERT_NE(at, std::string::npos) << damage.find;
    folder.write(name, text.replace(at, std::string(damage.find).size(), damage.replace));
    const std::string error = error_of_opening(path);
    EXPECT_THAT(error, HasSubstr(damage.message));
    EXPECT_EQ(error.find('\n'), std::string::npos) << "one line";
  }
}

TEST(SessionWriter, RefusesAFolderThatHoldsSomething) {
  const TemporaryFolder folder;
  recorded(folder);
  EXPECT_THAT(message_of<InputError>([&] { SessionWriter(folder.path() / "s", some_info()); }),
              HasSubstr("exists already"));
}

TEST(SessionWriter, ReportsAnImageItCannotWriteByTheEndAtTheLatest) {
  const TemporaryFolder folder;
  SessionWriter writer(folder.path() / "s", some_info());
  writer.frame(some_frame(0), test_image(0));
  fs::create_directories(folder.path() / "s/frames/mono");
  folder.write("s/frames/mono/in_the_way", "");
  FrameRecord astray = some_frame(1);
  astray.file = "frames/mono/in_the_way/1.png";
  writer.frame(astray, test_image(1));
  EXPECT_THAT(message_of<InputError>([&] { writer.close("complete"); }),
              HasSubstr("frames/mono/in_the_way: cannot be written: Not a directory"));
  const Session session = Session::open(folder.path() / "s");
  EXPECT_THAT(session.info.status, HasSubstr("stopped: ")) << "a session with a lost image is never complete";
  EXPECT_EQ(session.frames.size(), 1u) << "the lost one is left out, the other is there";
}

TEST(SessionWriter, ReportsAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder.path() / "full.csv");
  AppendFile file(folder.path() / "full.csv");
  file.append("a line\n");
  EXPECT_THAT(message_of<InputError>([&] { file.flush(); }),
              HasSubstr("full.csv: cannot be written: No space left on device"));
}

TEST(SessionWriter, DropsAndCountsFramesWhenTheDiskIsTooSlowForARealClock) {
  const TemporaryFolder folder;
  SessionWriterOptions options;
  options.wait_when_full = false;
  options.ring_bytes = 1;
  SessionInfo info = some_info();
  info.cameras[0].model.width = 1600, info.cameras[0].model.height = 1200;
  SessionWriter writer(folder.path() / "s", info, options);
  cv::Mat slow(1200, 1600, CV_8UC3);
  for (std::size_t i = 0; i < slow.total() * 3; ++i) slow.data[i] = static_cast<uchar>((i * 2654435761u) >> 13);
  for (int i = 0; i < 20; ++i) writer.frame(some_frame(i), slow);
  writer.close("complete");
  const Session session = Session::open(folder.path() / "s");
  const std::uint64_t dropped = session.info.counts.at(std::string("mono.") + SessionWriter::kDroppedByRing);
  EXPECT_GT(dropped, 0u);
  EXPECT_EQ(session.frames.size() + dropped, 20u);
  for (const FrameRecord& frame : session.frames) EXPECT_EQ(session.image(frame).cols, 1600);
  EXPECT_EQ(read_events_csv(session.path / "events.csv").records.size(), dropped);
}

TEST(SessionWriter, ThatIsNeverClosedLeavesAReadableSession) {
  const TemporaryFolder folder;
  {
    SessionWriter writer(folder.path() / "s", some_info());
    record(writer, 3);
  }
  const Session session = Session::open(folder.path() / "s");
  EXPECT_EQ(session.info.status, "stopped: not closed");
  EXPECT_EQ(session.frames.size(), 3u);
}

TEST(SessionSummary, TellsFramesPerPhaseAndWarnings) {
  const TemporaryFolder folder;
  const auto summary = session_summary(Session::open(recorded(folder)));
  EXPECT_THAT(summary, testing::Contains(testing::Pair("camera mono", HasSubstr("5 frames: 3 dark_before, 2 sweep"))));
  EXPECT_THAT(summary, testing::Contains(testing::Pair("not_recorded", "7")));
}

}  // namespace
}  // namespace tankrig
