// A reader of ROS 1 bags of our own: the records as the format's description has them, with their index.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tankrig::test {

struct BagTopic {
  std::string type, md5sum, definition;
  std::size_t messages = 0;
  bool in_order = true;  ///< of their times
  std::uint64_t first_ns = 0, last_ns = 0;
  std::string first;  ///< message, serialised
};

/// Reads a serialised message field by field. Source: wiki.ros.org/msg.
/// Errors: std::runtime_error past its end.
class MessageFields {
 public:
  explicit MessageFields(const std::string& bytes) : bytes_(bytes) {}

  template <class T>
  T next() {
    T value{};
    take(&value, sizeof value);
    return value;
  }
  std::string text() {
    std::string out(next<std::uint32_t>(), '\0');
    take(out.data(), out.size());
    return out;
  }
  template <class T>
  std::vector<T> list() {
    std::vector<T> out(next<std::uint32_t>());
    for (T& value : out) value = next<T>();
    return out;
  }
  /// A std_msgs/Header: its stamp in nanoseconds, and its frame.
  std::pair<std::uint64_t, std::string> header();

 private:
  void take(void* to, std::size_t size);

  const std::string& bytes_;
  std::size_t at_ = 0;
};

struct Bag {
  std::map<std::string, BagTopic> topics;
  std::size_t messages = 0;  ///< found in the chunks
  std::size_t indexed = 0;   ///< named by the index records behind the chunks
  std::size_t chunks = 0;    ///< chunk info records at the end
};

/// Uncompressed bags of version 2.0. Source: wiki.ros.org/Bags/Format/2.0.
/// Errors: std::runtime_error.
Bag read_bag(const std::string& bytes);

}  // namespace tankrig::test
