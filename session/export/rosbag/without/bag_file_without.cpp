// Stands in for bag_file.cpp in a build without librosbag-storage: says so.
#include "core/input_error.hpp"
#include "session/export/rosbag/bag_file.hpp"

namespace tankrig {

struct BagFile::Implementation {};

bool BagFile::available() noexcept { return false; }

BagFile::BagFile(const std::string& file) {
  throw InputError(file,
                   "cannot be written: tankrig was built without librosbag-storage: `./run with-bags` installs it and "
                   "builds again");
}

BagFile::~BagFile() = default;
void BagFile::close() {}
void BagFile::compressed_image(const std::string&, std::int64_t, const std::string&, const std::string&,
                               const std::string&) {}
void BagFile::image(const std::string&, std::int64_t, const std::string&, const cv::Mat&) {}
void BagFile::camera_info(const std::string&, std::int64_t, const std::string&, const CameraModel&,
                          const Rectification&) {}
void BagFile::joint_state(const std::string&, std::int64_t, const std::vector<std::string>&, const std::vector<double>&,
                          const std::vector<double>&) {}
void BagFile::transforms(std::int64_t, const std::vector<BagTransform>&, bool) {}
void BagFile::flag(const std::string&, std::int64_t, bool) {}
void BagFile::log(std::int64_t, const std::string&, const std::string&, bool) {}
void BagFile::cloud(const std::string&, std::int64_t, const std::string&, const std::vector<BagPointField>&,
                    std::uint32_t, std::uint32_t, const std::vector<std::uint8_t>&) {}

}  // namespace tankrig
