#include "apps/tankrig/session/session_bag.hpp"

#include <algorithm>
#include <cstring>
#include <functional>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "pipeline/reconstruct_session.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "reconstruction/stereo/rectifier.hpp"
#include "session/export/rosbag/bag_file.hpp"
#include "session/export/wall_clock.hpp"
#include "session/reading/session_tables.hpp"
#include "session/recording/event_kinds.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Frames of an imported session have no stamps: they are laid this far apart.
constexpr std::int64_t kImportedFramePeriod_ns = 40'000'000;

/// One message that waits for its turn.
struct Entry {
  std::int64_t wall_ns = 0;
  std::function<void(BagFile&, std::int64_t)> write;
};

class BagContent {
 public:
  BagContent(const OpenedSession& opened, bool raw_images)
      : session_(opened.session),
        joints_(opened.joints),
        events_(opened.events),
        raw_images_(raw_images),
        scan_(session_.info.kind == "scan"),
        clock_(session_, first()),
        rectified_(rectifications(session_)) {
    add_fixed_frames();
    if (scan_) add_joints();
    for (const FrameRecord& frame : session_.frames) add_frame(frame);
    if (scan_) add_events();
    add_clouds();
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const Entry& a, const Entry& b) { return a.wall_ns < b.wall_ns; });
  }

  void write(BagFile& bag) const {
    for (const Entry& entry : entries_) entry.write(bag, entry.wall_ns);
  }

 private:
  Stamp first() const {
    if (!joints_.empty()) return joints_.front().stamp;
    return session_.frames.empty() ? Stamp{} : session_.frames.front().stamp;
  }

  void add(std::int64_t wall_ns, std::function<void(BagFile&, std::int64_t)> write) {
    entries_.push_back({wall_ns, std::move(write)});
  }

  /// A camera's frame carries the camera's name; an imported session's only camera is c itself.
  void add_fixed_frames() {
    std::vector<BagTransform> fixed;
    if (scan_)
      for (const CalibratedCamera& camera : session_.info.cameras) fixed.push_back({"b", camera.name, camera.bMc});
    if (session_.info.object) fixed.push_back({"b", "o", session_.info.object->bMo});
    if (!fixed.empty())
      add(clock_.at(first()), [fixed](BagFile& bag, std::int64_t at) { bag.transforms(at, fixed, true); });
  }

  void add_joints() {
    const std::vector<std::string> names(kJointNames.begin(), kJointNames.end());
    for (const JointState& state : joints_)
      add(clock_.at(state.stamp), [this, names, &state](BagFile& bag, std::int64_t at) {
        bag.joint_state("/joint_states", at, names, {state.q.begin(), state.q.end()},
                        {state.velocity.begin(), state.velocity.end()});
        if (const auto& arm = session_.info.calibration.arm; arm && state.q.allFinite())
          bag.transforms(at, {{"b", "e", arm->bMe(state.q)}}, false);
      });
  }

  void add_frame(const FrameRecord& frame) {
    const std::int64_t since = scan_ ? 0 : frame.index * kImportedFramePeriod_ns;
    add(clock_.at(frame.stamp) + since, [this, &frame](BagFile& bag, std::int64_t at) {
      const std::string topic = "/" + frame.camera;
      if (raw_images_ || fs::path(frame.file).extension() != ".png")
        bag.image(topic + "/image_raw", at, frame.camera, session_.image(frame));
      else
        bag.compressed_image(topic + "/image_raw/compressed", at, frame.camera, "png",
                             read_whole_file(session_.path / frame.file));
      for (const CalibratedCamera& camera : session_.info.cameras)
        if (camera.name == frame.camera && !camera.model.port)  // camera_info has no place for a port
          bag.camera_info(topic + "/camera_info", at, frame.camera, camera.model, rectified_.at(camera.name));
    });
  }

  void add_events() {
    for (const SessionEvent& event : events_) {
      if (event.kind == event_kind::kLaser && (event.text == kLaserEmitting || event.text == kLaserDark))
        add(clock_.at(event.stamp), [on = event.text == kLaserEmitting](BagFile& bag, std::int64_t at) {
          bag.flag("/laser/emitting", at, on);
        });
      add(clock_.at(event.stamp), [&event](BagFile& bag, std::int64_t at) {
        bag.log(at, event.kind, event.text, event.kind == event_kind::kFault);
      });
    }
  }

  /// At the end: a cloud is made of all frames.
  void add_clouds() {
    std::int64_t end = clock_.at(first());
    for (const Entry& entry : entries_) end = std::max(end, entry.wall_ns);
    for (const std::string& method : kMethods) {
      const fs::path file = session_.path / "clouds" / (method + ".ply");
      if (!fs::exists(file)) continue;
      add(end, [this, method, file](BagFile& bag, std::int64_t at) {
        const PointCloud cloud = read_cloud(file);
        bag.cloud("/clouds/" + method, at, scan_ ? cloud.frame : session_.info.cameras.front().name, kFields, kStep,
                  static_cast<std::uint32_t>(cloud.points.size()), bytes_of(cloud));
      });
    }
  }

  static std::vector<std::uint8_t> bytes_of(const PointCloud& cloud) {
    std::vector<std::uint8_t> bytes(cloud.points.size() * kStep);
    std::uint8_t* at = bytes.data();
    for (const CloudPoint& point : cloud.points) {
      const float numbers[] = {static_cast<float>(point.p.x()), static_cast<float>(point.p.y()),
                               static_cast<float>(point.p.z()), point.intensity};
      std::memcpy(at, numbers, sizeof numbers);
      std::memcpy(at + 16, &point.frame, 4);
      std::memcpy(at + 20, &point.column, 4);
      std::memcpy(at + 24, &point.sigma, 4);
      at += kStep;
    }
    return bytes;
  }

  static constexpr std::uint32_t kStep = 28;
  inline static const std::vector<BagPointField> kFields{
      {"x", 0}, {"y", 4}, {"z", 8}, {"intensity", 12}, {"frame", 16, 5}, {"column", 20}, {"sigma", 24}};

  const Session& session_;
  const std::vector<JointState>& joints_;
  const std::vector<SessionEvent>& events_;
  const bool raw_images_, scan_;
  const WallClock clock_;
  const std::map<std::string, Rectification> rectified_;
  std::vector<Entry> entries_;
};

}  // namespace

std::map<std::string, Rectification> rectifications(const Session& session) {
  std::map<std::string, Rectification> out;
  for (const CalibratedCamera& camera : session.info.cameras) out[camera.name] = rectification_of(camera.model);
  const CalibratedCamera* left = session.find_camera(CameraRole::kLeft);
  const CalibratedCamera* right = session.find_camera(CameraRole::kRight);
  if (left && right) {
    const Rectifier pair({left->model, right->model, right->bMc.inverse() * left->bMc});
    out[left->name] = pair.left_rectification();
    out[right->name] = pair.right_rectification();
  }
  return out;
}

void write_session_bag(const OpenedSession& opened, bool raw_images, const fs::path& file) {
  if (!BagFile::available()) BagFile says_so(file.string());
  const BagContent content(opened, raw_images);
  fs::create_directories(file.parent_path());
  UnfinishedFile fresh(file);
  BagFile bag(fresh.path().string());
  content.write(bag);
  bag.close();
  fresh.put_in_place_durably();
}

}  // namespace tankrig::app
