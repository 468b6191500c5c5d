#include "session/export/rosbag/bag_file.hpp"

#include <rosbag/bag.h>
#include <rosgraph_msgs/Log.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Bool.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <boost/make_shared.hpp>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

ros::Time ros_time(std::int64_t wall_ns) {
  return {static_cast<std::uint32_t>(wall_ns / 1'000'000'000), static_cast<std::uint32_t>(wall_ns % 1'000'000'000)};
}

/// The connection of a topic whose last message a late listener is given too.
template <class Message>
boost::shared_ptr<ros::M_string> latched(const std::string& topic) {
  auto header = boost::make_shared<ros::M_string>();
  (*header)["topic"] = topic;
  (*header)["type"] = ros::message_traits::datatype<Message>();
  (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
  (*header)["message_definition"] = ros::message_traits::definition<Message>();
  (*header)["callerid"] = "/tankrig";
  (*header)["latching"] = "1";
  return header;
}

}  // namespace

struct BagFile::Implementation {
  std::string file;
  std::unique_ptr<rosbag::Bag> bag = std::make_unique<rosbag::Bag>();
  std::map<std::string, std::uint32_t> sequence;                     // by topic
  std::map<std::string, boost::shared_ptr<ros::M_string>> latching;  // by topic

  Implementation() = default;
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    try {
      bag->close();
    } catch (const rosbag::BagException&) {
      (void)bag.release();  // leaked: its destructor would close it once more, throw, and end the program
    }
  }

  template <class Action>
  void guard(Action action) {
    try {
      action();
    } catch (const rosbag::BagException& e) {
      throw InputError(file, std::string("cannot be written: ") + e.what());
    }
  }

  template <class Message>
  void stamp(Message& message, const std::string& topic, std::int64_t wall_ns, const std::string& frame_id) {
    message.header.seq = sequence[topic]++;
    message.header.stamp = ros_time(wall_ns);
    message.header.frame_id = frame_id;
  }

  template <class Message>
  void write(const std::string& topic, std::int64_t wall_ns, const Message& message, bool latch = false) {
    boost::shared_ptr<ros::M_string> header;
    if (latch) {
      auto& known = latching[topic];
      if (!known) known = latched<Message>(topic);
      header = known;
    }
    guard([&] { bag->write(topic, ros_time(wall_ns), message, header); });
  }
};

bool BagFile::available() noexcept { return true; }

BagFile::BagFile(const std::string& file) : bag_(std::make_unique<Implementation>()) {
  bag_->file = file;
  bag_->guard([&] { bag_->bag->open(file, rosbag::bagmode::Write); });
}

BagFile::~BagFile() = default;

void BagFile::close() {
  bag_->guard([&] { bag_->bag->close(); });
}

void BagFile::compressed_image(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                               const std::string& format, const std::string& bytes) {
  sensor_msgs::CompressedImage message;
  bag_->stamp(message, topic, wall_ns, frame_id);
  message.format = format;
  message.data.assign(bytes.begin(), bytes.end());
  bag_->write(topic, wall_ns, message);
}

void BagFile::image(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                    const cv::Mat& pixels) {
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  sensor_msgs::Image message;
  bag_->stamp(message, topic, wall_ns, frame_id);
  message.width = static_cast<std::uint32_t>(whole.cols);
  message.height = static_cast<std::uint32_t>(whole.rows);
  message.encoding = whole.channels() == 1 ? "mono8" : "bgr8";
  message.step = static_cast<std::uint32_t>(whole.cols * whole.channels());
  message.data.assign(whole.data, whole.data + whole.total() * whole.elemSize());
  bag_->write(topic, wall_ns, message);
}

void BagFile::camera_info(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                          const CameraModel& camera, const Rectification& rectification) {
  sensor_msgs::CameraInfo message;
  bag_->stamp(message, topic, wall_ns, frame_id);
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.distortion_model = "plumb_bob";
  message.D = {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3};
  message.K = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  std::copy(std::begin(rectification.R.val), std::end(rectification.R.val), message.R.begin());
  std::copy(std::begin(rectification.P.val), std::end(rectification.P.val), message.P.begin());
  bag_->write(topic, wall_ns, message);
}

void BagFile::joint_state(const std::string& topic, std::int64_t wall_ns, const std::vector<std::string>& names,
                          const std::vector<double>& position, const std::vector<double>& velocity) {
  sensor_msgs::JointState message;
  bag_->stamp(message, topic, wall_ns, "");
  message.name = names;
  message.position = position;
  message.velocity = velocity;
  bag_->write(topic, wall_ns, message);
}

void BagFile::transforms(std::int64_t wall_ns, const std::vector<BagTransform>& transforms, bool fixed) {
  tf2_msgs::TFMessage message;
  for (const BagTransform& t : transforms) {
    geometry_msgs::TransformStamped one;
    one.header.stamp = ros_time(wall_ns);
    one.header.frame_id = t.parent;
    one.child_frame_id = t.child;
    const Vector3d translation = t.parent_M_child.translation();
    const Eigen::Vector4d rotation = quaternion_xyzw(t.parent_M_child);
    one.transform.translation.x = translation.x();
    one.transform.translation.y = translation.y();
    one.transform.translation.z = translation.z();
    one.transform.rotation.x = rotation[0];
    one.transform.rotation.y = rotation[1];
    one.transform.rotation.z = rotation[2];
    one.transform.rotation.w = rotation[3];
    message.transforms.push_back(one);
  }
  bag_->write(fixed ? "/tf_static" : "/tf", wall_ns, message, fixed);
}

void BagFile::flag(const std::string& topic, std::int64_t wall_ns, bool value) {
  std_msgs::Bool message;
  message.data = value;
  bag_->write(topic, wall_ns, message);
}

void BagFile::log(std::int64_t wall_ns, const std::string& name, const std::string& text, bool error) {
  rosgraph_msgs::Log message;
  bag_->stamp(message, "/rosout", wall_ns, "");
  message.level = error ? rosgraph_msgs::Log::ERROR : rosgraph_msgs::Log::INFO;
  message.name = name;
  message.msg = text;
  bag_->write("/rosout", wall_ns, message);
}

void BagFile::cloud(const std::string& topic, std::int64_t wall_ns, const std::string& frame_id,
                    const std::vector<BagPointField>& fields, std::uint32_t step, std::uint32_t points,
                    const std::vector<std::uint8_t>& bytes) {
  sensor_msgs::PointCloud2 message;
  bag_->stamp(message, topic, wall_ns, frame_id);
  message.height = 1;
  message.width = points;
  for (const BagPointField& field : fields) {
    sensor_msgs::PointField one;
    one.name = field.name;
    one.offset = field.offset;
    one.datatype = field.type;
    one.count = 1;
    message.fields.push_back(one);
  }
  message.point_step = step;
  message.row_step = step * points;
  message.is_dense = true;
  message.data = bytes;
  bag_->write(topic, wall_ns, message, true);
}

}  // namespace tankrig
