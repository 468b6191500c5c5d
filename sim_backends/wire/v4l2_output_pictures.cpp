// Where an emulated V4L2 camera's settings and its pre-rendered pictures come from.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "core/input_error.hpp"
#include "core/picture_codecs.hpp"
#include "core/settings_table.hpp"
#include "core/text_files.hpp"
#include "sim_backends/wire/v4l2_output.hpp"

namespace tankrig::sim {
namespace {

namespace fs = std::filesystem;

cv::Mat raw_picture(const fs::path& file, int width, int height) {
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (bytes.size() != pixels && bytes.size() != 3 * pixels) return {};
  return cv::Mat(height, width, bytes.size() == pixels ? CV_8UC1 : CV_8UC3, bytes.data()).clone();
}

void read_format(const ConfigNode& node, const char* key, V4l2OutputSettings& s) {
  s.format = *pixel_format_from(node.choice(key, {"GREY", "YUYV", "BGR24"}));
}
void write_format(YAML::Emitter& out, const V4l2OutputSettings& s) { out << to_string(s.format); }

const Setting<V4l2OutputSettings> kV4l2OutputRows[] = {
    {"device", &V4l2OutputSettings::device, "of the emulator's end; size, rate and exposure are the scene's"},
    {"width_px", &V4l2OutputSettings::width, ConfigRange(2, 8192), "used outside a rig file"},
    {"height_px", &V4l2OutputSettings::height, ConfigRange(2, 8192), "likewise"},
    {"rate_hz", &V4l2OutputSettings::rate_hz, ConfigRange(0.1, 1000), "likewise"},
    {"pixel_format", {read_format, write_format, "GREY, YUYV, BGR24"}, "what it writes"},
    {"exposure_s", &V4l2OutputSettings::exposure, {1e-6, 10}, "used outside a rig file"},
    {"readout_s", &V4l2OutputSettings::readout, ConfigRange(0, 10),
     "from the end of the exposure to the picture's end"},
    {"stamped", &V4l2OutputSettings::stamped,
     "stamped at the end of the read-out, not counted; false: the kernel stamps and counts when it is written"},
};
void check_output(const ConfigNode& node, const V4l2OutputSettings& s) {
  if (s.format == PixelFormat::kYuyv && s.width % 2 != 0)
    node.fail("width_px", "found " + std::to_string(s.width) + ", expected an even width for YUYV");
  if (seconds(s.exposure) > 1 / s.rate_hz) node.fail("exposure_s", "expected at most the frame period, 1 / rate_hz");
}

}  // namespace

constinit const SettingsTable<V4l2OutputSettings> kV4l2OutputKeys{kV4l2OutputRows, check_output};

PictureSource pictures_of_folder(const fs::path& folder, int width, int height, PictureChoice choice) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".png" || entry.path().extension() == ".raw") files.push_back(entry.path());
  if (files.empty()) throw InputError(folder, "no picture here, expected *.png or *.raw");
  std::sort(files.begin(), files.end());
  auto pictures = std::make_shared<std::vector<cv::Mat>>();
  for (const fs::path& file : files) {
    cv::Mat picture = file.extension() == ".png" ? decode_by_opencv(read_whole_file(file), cv::IMREAD_UNCHANGED)
                                                 : raw_picture(file, width, height);
    if (picture.cols != width || picture.rows != height || picture.depth() != CV_8U ||
        (picture.channels() != 1 && picture.channels() != 3))
      throw InputError(file, fmt::format("expected {}x{}, 8-bit grey or BGR", width, height));
    pictures->push_back(std::move(picture));
  }
  return [pictures, choice = std::move(choice)](std::uint64_t index, Stamp begin, Duration exposure) {
    const std::size_t which = choice ? choice(index, begin, exposure) : static_cast<std::size_t>(index);
    return (*pictures)[which % pictures->size()];
  };
}

}  // namespace tankrig::sim
