// A ROS 1 bag (format 2.0) being written: the messages a session needs, in plain types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/camera_file.hpp"
#include "core/frames.hpp"

namespace tankrig {

/// parent_M_child: child-coordinates to parent.
struct BagTransform {
  std::string parent, child;
  Transform parent_M_child = Transform::Identity();
};

/// One column of a cloud's points. `type` is sensor_msgs/PointField's: 5 int32, 7 float32.
struct BagPointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t type = 7;
};

/// Units: `wall_ns` nanoseconds since 1970 UTC, at least 1 s; else SI. Frame ids as given.
/// Threads: one.
/// Errors: InputError naming the file.
class BagFile {
 public:
  /// Whether this program was built with librosbag-storage.
  static bool available() noexcept;

  /// Errors: InputError, also if this program was built without librosbag-storage.
  explicit BagFile(const std::string& file);
  ~BagFile();
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  /// sensor_msgs/CompressedImage: the file's own bytes.
  void compressed_image(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                        const std::string& format, const std::string& bytes);
  /// sensor_msgs/Image, mono8 or bgr8.
  void image(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id, const cv::Mat& pixels);
  /// sensor_msgs/CameraInfo, plumb_bob.
  void camera_info(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                   const CameraModel& camera, const Rectification& rectification);
  /// sensor_msgs/JointState.
  void joint_state(const std::string& topic, std::int64_t wall_ns, const std::vector<std::string>& names,
                   const std::vector<double>& position, const std::vector<double>& velocity);
  /// tf2_msgs/TFMessage on /tf, or latched on /tf_static.
  void transforms(std::int64_t wall_ns, const std::vector<BagTransform>& transforms, bool fixed);
  /// std_msgs/Bool.
  void flag(const std::string& topic, std::int64_t wall_ns, bool value);
  /// rosgraph_msgs/Log on /rosout: `error` or information.
  void log(std::int64_t wall_ns, const std::string& name, const std::string& text, bool error);
  /// sensor_msgs/PointCloud2, latched: `points` points of `step` bytes.
  void cloud(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
             const std::vector<BagPointField>& fields, std::uint32_t step, std::uint32_t points,
             const std::vector<std::uint8_t>& bytes);

  /// Writes the index. The last call.
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> bag_;
};

}  // namespace tankrig
