// A small scan's session replayed, exported and reconstructed: the same bits again, and files other programs read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "core/arm_model.hpp"
#include "core/camera_file.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "session/reading/session.hpp"
#include "session/reading/session_tables.hpp"
#include "tests/program/bag_reader.hpp"
#include "tests/program/scanned_session.hpp"

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

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

TEST(Reconstruct, PairsStereoFramesOfCamerasThatRunFree) {
  const fs::path session = copied();
  std::istringstream lines(read_text(session / "frames.csv"));
  std::string text;
  for (std::string line; std::getline(lines, line); text += line + "\n") {
    if (!line.starts_with("right,")) continue;
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    const std::string later = std::to_string(std::stoll(cells.at(3)) + 15'000'000);  // [ns] of a period of 40 ms
    line.replace(line.find(cells[3]), cells[3].size(), later);
  }
  const auto points = [&] {
    const ProgramRun run = run_tankrig({"reconstruct", session.string(), "--method", "stereo", "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.json().at("points").get<int>();
  };
  const int together = points();
  EXPECT_GT(together, 1000);
  write_text(session / "frames.csv", text);
  EXPECT_EQ(points(), together);
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

/// `table` with another text in every row of its column of stamps' sigmas, or without that column.
std::string with_sigma(const std::string& table, const std::string& text) {
  std::istringstream lines(table);
  std::string out;
  std::ptrdiff_t column = -1;
  for (std::string line; std::getline(lines, line); out += line + "\n") {
    const bool header = column < 0;
    if (header) column = std::count(line.data(), line.data() + line.find("stamp_sigma_ns"), ',');
    std::size_t at = 0;
    for (auto i = column; i > 0; --i) at = line.find(',', at) + 1;
    const std::size_t end = line.find(',', at);
    if (text.empty())
      line.erase(at, end + 1 - at);
    else if (!header)
      line.replace(at, end - at, text);
  }
  return out;
}

TEST(SessionReplay, GivesTheSameWhateverTheSigmasOfItsStampsAndWhereItHasNone) {
  const fs::path session = copied();
  const std::string table = read_text(session / "frames.csv");
  fs::remove(session / "SHA256SUMS");
  for (const char* sigma : {"5000000", ""}) {
    write_text(session / "frames.csv", with_sigma(table, sigma));
    const ProgramRun run = run_tankrig({"session", "replay", session.string(), "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
    EXPECT_EQ(run.json().at("identical_tables"), 2);
  }
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

/// Whether OpenCV's own reader finds in `file` the camera as `recorded` has it.
void expect_read_by_opencv(const fs::path& file, const CalibratedCamera& recorded) {
  ASSERT_TRUE(fs::exists(file)) << file;  // FileStorage throws of nothing
  const cv::FileStorage storage(file.string(), cv::FileStorage::READ);
  ASSERT_TRUE(storage.isOpened()) << file;
  cv::Mat matrix, distortion;
  storage["camera_matrix"] >> matrix;
  storage["distortion_coefficients"] >> distortion;
  EXPECT_EQ(static_cast<std::string>(storage["camera_name"]), recorded.name) << file;
  EXPECT_EQ(static_cast<int>(storage["image_width"]), recorded.model.width) << file;
  ASSERT_EQ(matrix.size(), cv::Size(3, 3)) << file;
  EXPECT_EQ(cv::norm(matrix, cv::Mat(recorded.model.matrix()), cv::NORM_INF), 0) << file;
  EXPECT_EQ(cv::norm(distortion, recorded.model.distortion(), cv::NORM_INF), 0) << file;
}

TEST(SessionExport, CamerasAreReadByOpenCvFromTheSessionAndFromTheExport) {
  const fs::path out = scratch_folder() / "out";
  ASSERT_EQ(run_tankrig({"session", "export", scanned().string(), "--format", "camera_info", "--out", out.string()})
                .exit_code,
            0);
  const Session session = Session::open(scanned());
  ASSERT_EQ(session.info.cameras.size(), 3u);
  for (const CalibratedCamera& camera : session.info.cameras)
    for (const fs::path& folder : {scanned() / "cameras", out / "camera_info"})
      expect_read_by_opencv(folder / (camera.name + ".opencv.yml"), camera);
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

TEST(SessionExport, WritesNoFileOver) {
  const fs::path out = scratch_folder() / "out";
  const std::vector<std::string> line{"session", "export", scanned().string(), "--format",
                                      "csv",     "--out",  out.string()};
  ASSERT_EQ(run_tankrig(line).exit_code, 0);
  write_text(out / "csv/joints.csv", "edited");
  const ProgramRun again = run_tankrig(line);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("joints.csv: exists already, expected another folder: --out"));
  EXPECT_EQ(read_text(out / "csv/joints.csv"), "edited");
}

TEST(SessionInfo, GivesNumbersAsNumbers) {
  const ProgramRun run = run_tankrig({"session", "info", scanned().string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json info = run.json();
  const Session session = Session::open(scanned());
  const CalibratedCamera& mono = session.camera(CameraRole::kMono);
  EXPECT_EQ(info.at("seed"), session.info.seed);
  EXPECT_EQ(info.at("length_s"), session.info.simulated_s);
  EXPECT_EQ(info.at("lux_before"), *session.info.lux_before);
  EXPECT_EQ(info.at("cameras").at("mono").at("width_px"), mono.model.width);
  int frames = 0;
  for (const auto& count : info.at("cameras").at("mono").at("frames")) frames += count.get<int>();
  EXPECT_EQ(frames, info.at("counts").at("mono.recorded"));
}

TEST(SessionList, SaysWhenWhichRigAndHowItEnded) {
  const fs::path folder = copied().parent_path();
  ProgramRun run = run_tankrig({"session", "list", folder.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Session session = Session::open(folder / "copy");
  for (const std::string& word : {session.info.created_utc, session.info.rig, session.info.status, std::string("copy")})
    EXPECT_THAT(run.out, HasSubstr(word));
  run = run_tankrig({"session", "list", folder.string(), "--rig", "another", "--json"});
  EXPECT_EQ(run.json(), nlohmann::json::array());
}

TEST(SessionExport, WantsAFormat) {
  EXPECT_EQ(run_tankrig({"session", "export", scanned().string()}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"session", "export", scanned().string(), "--format", "mp4"}).exit_code, 2);
}

class SessionBag : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path out = scratch_folder() / "out";
    const ProgramRun run =
        run_tankrig({"session", "export", scanned().string(), "--format", "bag", "--out", out.string()});
    if (run.err.find("built without librosbag-storage") != std::string::npos) GTEST_SKIP() << run.err;
    ASSERT_EQ(run.exit_code, 0) << run.err;
    session = Session::open(scanned());
    bag = read_bag(read_text(out / "scanned.bag"));
  }

  Session session;
  Bag bag;
};

TEST_F(SessionBag, HoldsEveryFrameJointAndCloudWithItsDefinition) {
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

TEST_F(SessionBag, SaysWhatTheSessionSays) {
  const auto wall = [&](Stamp stamp) {
    return static_cast<std::uint64_t>(stamp.ns + session.info.clock_begin->offset_ns());
  };

  const BagTopic& joints = bag.topics.at("/joint_states");
  const JointState state = read_joints_csv(scanned() / "joints.csv", false).records.front();
  MessageFields joint_state(joints.first);
  EXPECT_EQ(joint_state.header(), std::pair(wall(state.stamp), std::string()));
  EXPECT_EQ(joints.first_ns, wall(state.stamp));
  EXPECT_EQ(joint_state.next<std::uint32_t>(), kJoints);
  for (const char* name : kJointNames) EXPECT_EQ(joint_state.text(), name);
  EXPECT_EQ(joint_state.list<double>(), std::vector<double>(state.q.begin(), state.q.end()));
  EXPECT_EQ(joint_state.list<double>(), std::vector<double>(state.velocity.begin(), state.velocity.end()));

  for (const CalibratedCamera& camera : session.info.cameras) {
    const auto frame = std::find_if(session.frames.begin(), session.frames.end(),
                                    [&](const FrameRecord& f) { return f.camera == camera.name; });
    MessageFields picture(bag.topics.at("/" + camera.name + "/image_raw/compressed").first);
    EXPECT_EQ(picture.header(), std::pair(wall(frame->stamp), camera.name));
    EXPECT_EQ(picture.text(), "png");
    const auto bytes = picture.list<std::uint8_t>();
    EXPECT_EQ(std::string(bytes.begin(), bytes.end()), read_text(scanned() / frame->file)) << camera.name;

    MessageFields info(bag.topics.at("/" + camera.name + "/camera_info").first);
    EXPECT_EQ(info.header(), std::pair(wall(frame->stamp), camera.name));
    EXPECT_EQ(info.next<std::uint32_t>(), static_cast<std::uint32_t>(camera.model.height));
    EXPECT_EQ(info.next<std::uint32_t>(), static_cast<std::uint32_t>(camera.model.width));
    EXPECT_EQ(info.text(), "plumb_bob");
    const CameraModel& m = camera.model;
    EXPECT_EQ(info.list<double>(), (std::vector<double>{m.k1, m.k2, m.p1, m.p2, m.k3}));
    for (const double k : {m.fx, 0.0, m.cx, 0.0, m.fy, m.cy, 0.0, 0.0, 1.0}) EXPECT_EQ(info.next<double>(), k);
    for (int i = 0; i < 9; ++i) info.next<double>();  // R
    std::array<double, 12> P;
    for (double& p : P) p = info.next<double>();
    const Vector3d to_left = session.camera(CameraRole::kLeft).bMc.inverse() * camera.bMc.translation();
    const double baseline = camera.role == CameraRole::kRight ? to_left.norm() : 0;
    EXPECT_NEAR(-P[3] / P[0], baseline, 1e-6) << camera.name;
  }

  MessageFields cloud(bag.topics.at("/clouds/laser").first);
  const PointCloud points = read_cloud(scanned() / "clouds" / "laser.ply");
  EXPECT_EQ(cloud.header().second, points.frame);
  EXPECT_EQ(cloud.next<std::uint32_t>(), 1u);
  EXPECT_EQ(cloud.next<std::uint32_t>(), points.points.size());
  for (auto fields = cloud.next<std::uint32_t>(); fields > 0; --fields) {
    cloud.text();
    cloud.next<std::uint32_t>(), cloud.next<std::uint8_t>(), cloud.next<std::uint32_t>();
  }
  EXPECT_EQ(cloud.next<std::uint8_t>(), 0) << "little end first";
  cloud.next<std::uint32_t>(), cloud.next<std::uint32_t>(), cloud.next<std::uint32_t>();  // steps, length
  for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(cloud.next<float>(), static_cast<float>(points.points[0].p[axis]));

  MessageFields laser(bag.topics.at("/laser/emitting").first);
  EXPECT_EQ(laser.next<std::uint8_t>(), 1) << "it went on first";
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
