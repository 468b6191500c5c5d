// `tankrig session replay` and `export` of a small scan: the same bits again, and files other programs read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/camera_model.hpp"
#include "rig/session/session.hpp"
#include "tests/program/bag_reader.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

void replace_in(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

/// A tenth of the default sweep, made once for all tests.
const fs::path& scanned() {
  static const fs::path session = [] {
    const fs::path folder = scratch_folder().parent_path();
    const fs::path rig = edited_rig(folder / "rig", "from_rad: 1.3\n", "from_rad: 1.68\n");
    std::string text = read_text(rig);
    replace_in(text, "to_rad: 2.1", "to_rad: 1.76");
    replace_in(text, "dark_frames: 10", "dark_frames: 2");
    write_text(rig, text);
    const ProgramRun run = run_tankrig({"scan", "--rig", rig.string(), "--out", (folder / "scanned").string()});
    if (run.exit_code != 0) throw std::runtime_error("scan failed: " + run.err);
    return folder / "scanned";
  }();
  return session;
}

/// A copy to be changed.
fs::path copied() {
  const fs::path copy = scratch_folder() / "copy";
  fs::copy(scanned(), copy, fs::copy_options::recursive);
  return copy;
}

std::vector<std::string> differences(const ProgramRun& run) {
  return run.json().at("differences").get<std::vector<std::string>>();
}

TEST(SessionReplay, GivesTheSameTablesImagesCloudsAndScoresOnOneCoreToo) {
  const ProgramRun run = run_tankrig({"session", "replay", scanned().string(), "--json"}, {}, true);
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const auto json = run.json();
  EXPECT_TRUE(json.at("identical").get<bool>());
  EXPECT_TRUE(json.at("fed").get<bool>());
  EXPECT_EQ(json.at("identical_tables"), 2);
  EXPECT_EQ(json.at("identical_images"), Session::open(scanned()).frames.size());
  EXPECT_EQ(json.at("identical_clouds"), 4 * 2 + 2);
  EXPECT_EQ(json.at("identical_scores"), 4);
  for (const fs::directory_entry& entry : fs::directory_iterator(scanned().parent_path()))
    EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr(".replay-")));
}

TEST(SessionReplay, KeepsASessionThatReplaysAgain) {
  const fs::path out = scratch_folder() / "kept";
  EXPECT_EQ(run_tankrig({"session", "replay", scanned().string(), "--out", out.string()}).exit_code, 0);
  EXPECT_TRUE(fs::exists(out / "replay.json"));
  EXPECT_EQ(run_tankrig({"session", "replay", out.string()}).exit_code, 0);
  const ProgramRun again = run_tankrig({"session", "replay", scanned().string(), "--out", out.string()});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("exists already"));
}

TEST(SessionReplay, NamesAFrameWhosePixelsWereChangedAndTheCloudsThatFollow) {
  const fs::path session = copied();
  const Session recorded = Session::open(session);
  const auto frame = std::find_if(recorded.frames.begin(), recorded.frames.end(),
                                  [](const FrameRecord& f) { return f.laser_on && f.index > 10; });
  ASSERT_NE(frame, recorded.frames.end());
  cv::Mat image = recorded.image(*frame);
  image(cv::Rect(0, image.rows / 4, image.cols, image.rows / 2)) = cv::Scalar::all(0);
  cv::imwrite((session / frame->file).string(), image);
  const ProgramRun run = run_tankrig({"session", "replay", session.string(), "--json"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(differences(run), Contains(HasSubstr(frame->file)));
  EXPECT_THAT(differences(run), Contains(HasSubstr("clouds/laser.ply: ")));
  EXPECT_THAT(differences(run), Contains(HasSubstr("results/laser.json: ")));
}

TEST(SessionReplay, NamesTheLineOfAFrameWhoseJointsWereChanged) {
  const fs::path session = copied();
  const Session recorded = Session::open(session);
  const Stamp frame = recorded.frames[recorded.frames.size() / 2].stamp;
  std::string joints = read_text(session / "joints.csv");
  std::size_t sample = 0;  // the last one before the frame
  for (std::size_t at = joints.find('\n') + 1; std::stoll(joints.substr(at, 32)) <= frame.ns;
       at = joints.find('\n', at) + 1)
    sample = at;
  ASSERT_GT(sample, 0u);
  std::size_t elbow = sample;
  for (int column = 0; column < 3; ++column) elbow = joints.find(',', elbow) + 1;
  joints.replace(elbow, joints.find(',', elbow) - elbow, "1.7");
  write_text(session / "joints.csv", joints);
  const ProgramRun run = run_tankrig({"session", "replay", session.string(), "--json"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(differences(run), Contains(HasSubstr("joints.csv")));
  EXPECT_THAT(differences(run), Contains(testing::ContainsRegex("frames.csv: line [0-9]+ differs")));
}

TEST(SessionReplay, SaysWhatCannotBeFedAgainOfAnImport) {
  const fs::path photos = scratch_folder() / "photos";
  fs::create_directories(photos);
  const Session recorded = Session::open(scanned());
  for (const FrameRecord& frame : recorded.frames)
    if (frame.camera == recorded.frames[0].camera && frame.index < 2)
      fs::copy_file(recorded.path / frame.file, photos / ("photo" + std::to_string(frame.index) + ".png"));
  const fs::path session = scratch_folder() / "imported";
  ASSERT_EQ(run_tankrig({"session", "import", "--images", photos.string(), "--camera",
                         (scanned() / "cameras" / (recorded.frames[0].camera + ".yaml")).string(), "--plane",
                         "1,0,0.1,0.05", "--out", session.string()})
                .exit_code,
            0);
  ASSERT_EQ(run_tankrig({"reconstruct", session.string()}).exit_code, 0);
  const ProgramRun run = run_tankrig({"session", "replay", session.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err << run.out;
  EXPECT_THAT(run.out, HasSubstr("not fed again: the session is an import"));
  EXPECT_THAT(run.out, HasSubstr("identical"));
}

TEST(SessionExport, WritesEveryFormat) {
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"session", "export", scanned().string(), "--all", "--out", out.string()});
  EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 3) << run.err;
  EXPECT_THAT(read_text(out / "candump_synthesised.log"), HasSubstr(" synth0 181#"));
  for (const char* name : {"mono", "left", "right"})
    EXPECT_EQ(read_camera_file(out / "camera_info" / (std::string(name) + ".yaml")).width,
              read_camera_file(scanned() / "cameras" / (std::string(name) + ".yaml")).width);
  for (const char* name : {"joints.csv", "frames.csv", "events.csv"}) EXPECT_TRUE(fs::exists(out / "csv" / name));
}

TEST(SessionExport, WantsAFormat) {
  EXPECT_EQ(run_tankrig({"session", "export", scanned().string()}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"session", "export", scanned().string(), "--format", "mp4"}).exit_code, 2);
}

TEST(SessionExport, BagHoldsEveryFrameJointAndCloudWithItsDefinition) {
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run =
      run_tankrig({"session", "export", scanned().string(), "--format", "bag", "--out", out.string()});
  if (run.err.find("built without librosbag-storage") != std::string::npos) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Session session = Session::open(scanned());
  const Bag bag = read_bag(read_text(out / "scanned.bag"));
  std::map<std::string, std::size_t> frames;
  for (const FrameRecord& frame : session.frames) ++frames[frame.camera];
  for (const auto& [camera, count] : frames) {
    EXPECT_EQ(bag.topics.at("/" + camera + "/image_raw/compressed").messages, count);
    EXPECT_EQ(bag.topics.at("/" + camera + "/camera_info").messages, count);
  }
  const std::string joints = read_text(scanned() / "joints.csv");
  const auto samples = static_cast<std::size_t>(std::count(joints.begin(), joints.end(), '\n')) - 1;
  EXPECT_EQ(bag.topics.at("/joint_states").messages, samples);
  EXPECT_EQ(bag.topics.at("/tf").messages, samples);
  EXPECT_EQ(bag.topics.at("/laser/emitting").messages, 2u);
  EXPECT_EQ(bag.topics.at("/clouds/laser").messages, 1u);
  EXPECT_EQ(bag.topics.at("/tf_static").type, "tf2_msgs/TFMessage");
  for (const auto& [name, topic] : bag.topics) {
    EXPECT_EQ(topic.md5sum.size(), 32u) << name;
    EXPECT_FALSE(topic.definition.empty()) << name;
    EXPECT_TRUE(topic.in_order) << name;
  }
  EXPECT_EQ(bag.topics.at("/clouds/laser").md5sum, "1158d486dd51d683ce2f1be655c3c181");  // sensor_msgs/PointCloud2
  EXPECT_EQ(bag.indexed, bag.messages);
}

TEST(SessionExport, BagIsOpenedByRosbagInfo) {
  if (std::system("command -v rosbag >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "rosbag (package python3-rosbag) is not installed";
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run =
      run_tankrig({"session", "export", scanned().string(), "--format", "bag", "--raw-images", "--out", out.string()});
  if (run.err.find("built without librosbag-storage") != std::string::npos) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path info = out / "info.txt";
  ASSERT_EQ(std::system(("rosbag info " + (out / "scanned.bag").string() + " > " + info.string()).c_str()), 0);
  const std::string text = read_text(info);
  EXPECT_THAT(text, HasSubstr("version:     2.0"));
  EXPECT_THAT(text, HasSubstr("sensor_msgs/Image"));
  EXPECT_THAT(text, HasSubstr("sensor_msgs/PointCloud2"));
}

}  // namespace
}  // namespace tankrig::test
