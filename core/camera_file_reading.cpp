#include "core/camera_file_reading.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cmath>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

struct Parameter {
  const char* name;
  double CameraModel::*member;
  ConfigRange range;
};
constexpr Parameter kPinhole[] = {{"fx", &CameraModel::fx, kFocalRange},
                                  {"fy", &CameraModel::fy, kFocalRange},
                                  {"cx", &CameraModel::cx, kPrincipalPointRange},
                                  {"cy", &CameraModel::cy, kPrincipalPointRange}};
constexpr Parameter kDistortion[] = {{"k1", &CameraModel::k1, kRadialRange},
                                     {"k2", &CameraModel::k2, kRadialRange},
                                     {"p1", &CameraModel::p1, kTangentialRange},
                                     {"p2", &CameraModel::p2, kTangentialRange},
                                     {"k3", &CameraModel::k3, kRadialRange}};

void set(CameraModel& camera, const Parameter& parameter, double value, const CameraFileReading& file,
         const CameraValue& at, const std::string& field) {
  const auto& [name, member, range] = parameter;
  if (!(value >= range.lower && value <= range.upper))
    file.fail(at, field,
              fmt::format("found {} = {}, expected a number from {} to {}", name, exact_text(value),
                          exact_text(range.lower), exact_text(range.upper)));
  camera.*member = value;
}

}  // namespace

void CameraFileReading::fail(const CameraValue& at, const std::string& field, const std::string& message) const {
  throw InputError(path, at.line, field + ": " + message);
}

std::pair<std::string, CameraValue> CameraFileReading::find(std::initializer_list<const char*> names) const {
  for (const char* name : names)
    if (CameraValue value = fields(name); value.present()) return {name, std::move(value)};
  return {*names.begin(), {}};
}

double CameraFileReading::number(const CameraValue& at, const std::string& field) const {
  const std::string& text = at.text;
  const char* first = text.data() + (text.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, ec] = std::from_chars(first, text.data() + text.size(), value);
  const bool all = end == text.data() + text.size() || std::string_view(end) == ".";
  if (ec != std::errc{} || !all || !std::isfinite(value))
    fail(at, field, "found '" + shown_text(text) + "', expected a number");
  return value;
}

std::vector<double> CameraFileReading::matrix(const CameraValue& value, const std::string& field) const {
  if (value.kind != CameraValue::Kind::kMapping) return flat_list(value, field);
  const CameraValue &data = value.child("data"), &rows = value.child("rows"), &cols = value.child("cols");
  if (!data.present()) fail(value, field, "found no 'data', expected rows, cols and data");
  std::vector<double> values = flat_list(data, field + ".data");
  if (rows.present() && cols.present()) {
    const double expected = number(rows, field + ".rows") * number(cols, field + ".cols");
    if (expected != static_cast<double>(values.size()))
      fail(data, field + ".data", fmt::format("found {} numbers, expected rows x cols = {}", values.size(), expected));
  }
  return values;
}

std::vector<double> CameraFileReading::flat_list(const CameraValue& list, const std::string& field,
                                                 std::size_t count) const {
  if (list.kind != CameraValue::Kind::kList) fail(list, field, "found no list, expected numbers");
  std::vector<double> values;
  for (const CameraValue& item : list.items) {
    if (item.kind == CameraValue::Kind::kList)
      for (const CameraValue& inner : item.items) values.push_back(number(inner, field));
    else
      values.push_back(number(item, field));
  }
  if (count > 0 && values.size() != count)
    fail(list, field, fmt::format("found {} numbers, expected {}", values.size(), count));
  return values;
}

int CameraFileReading::pixels(const CameraValue& value, const std::string& field) const {
  const double pixels = number(value, field);
  if (pixels < 1 || pixels > 100000 || pixels != std::floor(pixels))
    fail(value, field, "found " + shown_text(value.text) + ", expected a whole number of pixels from 1 to 100000");
  return static_cast<int>(pixels);
}

void CameraFileReading::set_pinhole(CameraModel& camera, const std::array<double, 4>& numbers, const CameraValue& at,
                                    const std::string& field) const {
  for (std::size_t i = 0; i < numbers.size(); ++i) set(camera, kPinhole[i], numbers[i], *this, at, field);
}

void CameraFileReading::set_distortion(CameraModel& camera, const std::vector<double>& numbers, const CameraValue& at,
                                       const std::string& field) const {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (i < std::size(kDistortion))
      set(camera, kDistortion[i], numbers[i], *this, at, field);
    else if (numbers[i] != 0)
      fail(at, field, "found a coefficient beyond k3 that is not 0, expected k1, k2, p1, p2, k3 only");
}

void CameraFileReading::check(const CameraModel& camera) const {
  if (!camera.invertible()) throw InputError(path, kFoldsOver);
}

std::string plain_number(double value) {
  std::string text = exact_text(value);
  const std::size_t exponent = text.find('e');
  if (exponent != text.npos && text.find('.') == text.npos) text.insert(exponent, ".0");
  return text;
}

}  // namespace tankrig
