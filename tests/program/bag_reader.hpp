// A reader of ROS 1 bags of our own: the records as the format's description has them, with their index.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace tankrig::test {

struct BagTopic {
  std::string type, md5sum, definition;
  std::size_t messages = 0;
  bool in_order = true;  ///< of their times
  std::uint64_t last_ns = 0;
};

struct Bag {
  std::map<std::string, BagTopic> topics;
  std::size_t messages = 0;  ///< found in the chunks
  std::size_t indexed = 0;   ///< named by the index records behind the chunks
  std::size_t chunks = 0;    ///< chunk info records at the end
};

/// Uncompressed bags of version 2.0.  Source: wiki.ros.org/Bags/Format/2.0.  Errors: std::runtime_error.
Bag read_bag(const std::string& bytes);

}  // namespace tankrig::test
