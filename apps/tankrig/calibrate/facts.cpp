#include "apps/tankrig/calibrate/facts.hpp"

#include <fmt/core.h>

#include <opencv2/imgcodecs.hpp>

#include "core/angles.hpp"
#include "core/model_yaml.hpp"
#include "core/regular_file.hpp"
#include "session/reading/picture_file.hpp"

namespace tankrig::app {
namespace {

std::string yaml_lines(const nlohmann::ordered_json& object, const std::string& margin) {
  std::string out;
  for (const auto& [key, value] : object.items())
    out +=
        margin + key + ":" + (value.is_object() ? "\n" + yaml_lines(value, margin + "  ") : " " + value.dump() + "\n");
  return out;
}

struct ShownUnit {
  const char* name;
  double scale;
};
ShownUnit shown(const std::string& unit) {
  if (unit == "rad") return {"deg", to_degrees(1)};
  if (unit == "m") return {"mm", 1e3};
  return {unit.c_str(), 1};
}

}  // namespace

std::string yaml_text(const nlohmann::ordered_json& object) { return yaml_lines(object, ""); }

nlohmann::ordered_json pose_json(const Transform& aMb) {
  const Eigen::Vector4d q = quaternion_xyzw(aMb);
  return {{"translation_m", {aMb.translation().x(), aMb.translation().y(), aMb.translation().z()}},
          {"quaternion_xyzw", {q[0], q[1], q[2], q[3]}}};
}

nlohmann::ordered_json estimates_json(const std::vector<Estimate>& estimates) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Estimate& e : estimates) {
    const auto [unit, scale] = shown(e.unit);
    out.push_back({{"name", e.name},
                   {"unit", unit},
                   {"value", scale * e.value},
                   {"sigma", scale * e.sigma},
                   {"interval_95", {scale * (e.value - e.half_width), scale * (e.value + e.half_width)}},
                   {"effect_on_target_mm", 1e3 * e.effect}});
  }
  return out;
}

std::string estimate_lines(const std::vector<Estimate>& estimates) {
  std::string out =
      fmt::format("  {:<24} {:>12} {:>10} {:>10}  {:<4} {:>12}\n", "", "value", "sigma", "95 % +-", "", "on target");
  for (const Estimate& e : estimates) {
    const auto [unit, scale] = shown(e.unit);
    out += fmt::format("  {:<24} {:>12.4f} {:>10.4f} {:>10.4f}  {:<4} {:>9.3f} mm\n", e.name, scale * e.value,
                       scale * e.sigma, scale * e.half_width, unit, 1e3 * e.effect);
  }
  return out;
}

std::string pose_line(const Transform& aMb) { return yaml_of(aMb); }

cv::Mat read_picture(const std::filesystem::path& file, int width, int height, bool grey) {
  const ExpectedSize expected{width, height, "as in the camera file"};
  return decode_picture(read_regular_file(file, kMostPictureBytes, "an image"), file, &expected,
                        (grey ? cv::IMREAD_GRAYSCALE : cv::IMREAD_COLOR) | cv::IMREAD_IGNORE_ORIENTATION);
}

}  // namespace tankrig::app
