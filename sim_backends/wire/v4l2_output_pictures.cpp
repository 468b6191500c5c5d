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

}  // namespace

V4l2OutputSettings v4l2_output_settings_from(const ConfigNode& node) {
  V4l2OutputSettings settings;
  settings.device = node.text_or("device", settings.device);
  settings.width = node.integer_or("width_px", settings.width, {2, 8192});
  settings.height = node.integer_or("height_px", settings.height, {2, 8192});
  settings.rate_hz = node.number_or("rate_hz", settings.rate_hz, {0.1, 1000});
  if (node.has("pixel_format"))
    settings.format = *pixel_format_from(node.choice("pixel_format", {"GREY", "YUYV", "BGR24"}));
  settings.exposure = from_seconds(node.number_or("exposure_s", seconds(settings.exposure), {1e-6, 10}));
  settings.readout = from_seconds(node.number_or("readout_s", seconds(settings.readout), {0, 10}));
  settings.stamped = node.flag_or("stamped", settings.stamped);
  if (settings.format == PixelFormat::kYuyv && settings.width % 2 != 0)
    node.fail("width_px", fmt::format("found {}, expected an even width for YUYV", settings.width));
  if (seconds(settings.exposure) > 1 / settings.rate_hz)
    node.fail("exposure_s", "expected at most the frame period, 1 / rate_hz");
  return settings;
}

PictureSource pictures_of_folder(const fs::path& folder, int width, int height, PictureChoice choice) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".png" || entry.path().extension() == ".raw") files.push_back(entry.path());
  if (files.empty()) throw InputError(folder, "no picture here, expected *.png or *.raw");
  std::sort(files.begin(), files.end());
  auto pictures = std::make_shared<std::vector<cv::Mat>>();
  for (const fs::path& file : files) {
    cv::Mat picture =
        file.extension() == ".png" ? cv::imread(file.string(), cv::IMREAD_UNCHANGED) : raw_picture(file, width, height);
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
