// ViSP's camera parameters in XML. Its kud is our k1: u = u0 + px x (1 + kud r^2). Its kdu is a fit of its own to the
// inverse, which tankrig does not need: it inverts k1 exactly.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/camera_file_reading.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr std::string_view kPlain = "perspectiveProjWithoutDistortion", kDistorted = "perspectiveProjWithDistortion";

/// Element `name` below `parent`, as a value of a camera file.
CameraValue value_of(const CameraXml& xml, const CameraFileReading& file, const pugi::xml_node& parent,
                     const char* name) {
  const pugi::xml_node element = parent.child(name);
  if (!element) throw InputError(file.path, xml.line_of(parent), fmt::format("{}: missing, expected a number", name));
  std::string_view text = element.text().get();
  constexpr std::string_view kSpace = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  text = text.substr(0, text.find_last_not_of(kSpace) + 1);
  return {CameraValue::Kind::kScalar, xml.line_of(element), std::string(text), {}, {}};
}

/// The model with distortion, or else the one without.
pugi::xml_node model_of(const pugi::xml_node& camera) {
  pugi::xml_node plain;
  for (const pugi::xml_node model : camera.children("model")) {
    if (model.child("type").text().get() == kDistorted) return model;
    if (model.child("type").text().get() == kPlain) plain = model;
  }
  return plain;
}

/// The kdu that undoes k1 best over the picture, in ViSP's x (1 + kdu (xd^2 + yd^2)).
double best_inverse(const CameraModel& c) {
  constexpr int kSteps = 20;
  double top = 0, bottom = 0;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const double u = i * (c.width - 1.0) / kSteps, v = j * (c.height - 1.0) / kSteps;
      const Vector2d d((u - c.cx) / c.fx, (v - c.cy) / c.fy), change = c.normalized(u, v) - d;
      const Vector2d slope = d * d.squaredNorm();
      top += slope.dot(change), bottom += slope.squaredNorm();
    }
  return bottom > 0 ? top / bottom : 0;
}

}  // namespace

std::vector<FileCamera> read_visp_file(const CameraXml& xml, const std::filesystem::path& path) {
  const CameraFileReading file{path, {}};
  std::vector<FileCamera> cameras;
  for (const pugi::xml_node element : xml.root().children("camera")) {
    FileCamera camera{element.child("name").text().get(), {}, {}, {}};
    if (camera.name.empty()) camera.name = "camera";
    const auto field = [&](const pugi::xml_node& parent, const char* name) {
      const CameraValue value = value_of(xml, file, parent, name);
      return std::pair{value, file.number(value, name)};
    };
    const CameraValue width = value_of(xml, file, element, "image_width"),
                      height = value_of(xml, file, element, "image_height");
    camera.model.width = file.pixels(width, "image_width");
    camera.model.height = file.pixels(height, "image_height");
    const pugi::xml_node model = model_of(element);
    if (!model)
      throw InputError(path, xml.line_of(element),
                       "model: found '" + shown_text(element.child("model").child("type").text().get()) +
                           "', expected " + std::string(kDistorted) + " or " + std::string(kPlain));
    const auto px = field(model, "px");
    file.set_pinhole(camera.model,
                     {px.second, field(model, "py").second, field(model, "u0").second, field(model, "v0").second},
                     px.first, "px, py, u0, v0");
    if (model.child("type").text().get() == kDistorted) {
      const auto kud = field(model, "kud");
      file.set_distortion(camera.model, {kud.second}, kud.first, "kud");
    }
    file.check(camera.model);
    cameras.push_back(std::move(camera));
  }
  if (cameras.empty())
    throw InputError(path, xml.line_of(xml.root()), "found no <camera>, expected ViSP's camera parameters");
  return cameras;
}

std::string visp_text(const FileCamera& camera) {
  const CameraModel& c = camera.model;
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("root"), element = root.append_child("camera");
  const auto put = [](pugi::xml_node parent, const char* name, const std::string& text) {
    parent.append_child(name).text().set(text.c_str());
  };
  put(element, "name", camera.name);
  put(element, "image_width", std::to_string(c.width));
  put(element, "image_height", std::to_string(c.height));
  pugi::xml_node model = element.append_child("model");
  put(model, "type", std::string(kDistorted));
  put(model, "px", exact_text(c.fx));
  put(model, "py", exact_text(c.fy));
  put(model, "u0", exact_text(c.cx));
  put(model, "v0", exact_text(c.cy));
  put(model, "kud", exact_text(c.k1));
  put(model, "kdu", exact_text(best_inverse(c)));
  struct Text : pugi::xml_writer {
    std::string text;
    void write(const void* data, std::size_t size) override { text.append(static_cast<const char*>(data), size); }
  } out;
  document.save(out, "  ");
  return out.text;
}

}  // namespace tankrig
