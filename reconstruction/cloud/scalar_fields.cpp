#include "reconstruction/cloud/scalar_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig::cloud_file {
namespace {

template <class T>
double as(const char* bytes, bool big_endian) {
  std::array<char, sizeof(T)> copy;
  std::memcpy(copy.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(copy.begin(), copy.end());
  T value;
  std::memcpy(&value, copy.data(), sizeof(T));
  return static_cast<double>(value);
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

}  // namespace

std::size_t size_of(Scalar type) {
  static constexpr std::array<std::size_t, 10> kSizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

double full_scale(Scalar type) {
  static constexpr std::array<double, 10> kScales{
      127, 255, 32767, 65535, 2147483647.0, 4294967295.0, 9.223372036854776e18, 1.8446744073709552e19, 1, 1};
  return kScales[static_cast<std::size_t>(type)];
}

double decode(const char* bytes, Scalar type, bool big_endian) {
  switch (type) {
    case Scalar::kI8:
      return as<std::int8_t>(bytes, big_endian);
    case Scalar::kU8:
      return as<std::uint8_t>(bytes, big_endian);
    case Scalar::kI16:
      return as<std::int16_t>(bytes, big_endian);
    case Scalar::kU16:
      return as<std::uint16_t>(bytes, big_endian);
    case Scalar::kI32:
      return as<std::int32_t>(bytes, big_endian);
    case Scalar::kU32:
      return as<std::uint32_t>(bytes, big_endian);
    case Scalar::kI64:
      return as<std::int64_t>(bytes, big_endian);
    case Scalar::kU64:
      return as<std::uint64_t>(bytes, big_endian);
    case Scalar::kF32:
      return as<float>(bytes, big_endian);
    case Scalar::kF64:
      return as<double>(bytes, big_endian);
  }
  return 0;
}

Target target_of(std::string_view property) {
  static constexpr std::array<std::pair<std::string_view, Target>, 14> kTargets{
      {{"x", Target::kX},
       {"y", Target::kY},
       {"z", Target::kZ},
       {"intensity", Target::kIntensity},
       {"scalar_intensity", Target::kIntensity},
       {"frame", Target::kFrame},
       {"column", Target::kColumn},
       {"sigma", Target::kSigma},
       {"nx", Target::kNx},
       {"ny", Target::kNy},
       {"nz", Target::kNz},
       {"normal_x", Target::kNx},
       {"normal_y", Target::kNy},
       {"normal_z", Target::kNz}}};
  for (const auto& [name, target] : kTargets)
    if (name == property) return target;
  return Target::kNone;
}

void PointCollector::set(Target target, Scalar type, double value) {
  constexpr double kMaxFrame = std::numeric_limits<std::int32_t>::max();
  switch (target) {
    case Target::kNone:
      break;
    case Target::kX:
      point_.p.x() = value;
      break;
    case Target::kY:
      point_.p.y() = value;
      break;
    case Target::kZ:
      point_.p.z() = value;
      break;
    case Target::kIntensity:
      point_.intensity = static_cast<float>(value / full_scale(type));
      break;
    case Target::kFrame:
      if (value >= -1 && value <= kMaxFrame) point_.frame = static_cast<std::int32_t>(value);
      break;
    case Target::kColumn:
      point_.column = static_cast<float>(value);
      break;
    case Target::kSigma:
      point_.sigma = static_cast<float>(value);
      break;
    case Target::kNx:
    case Target::kNy:
    case Target::kNz:
      point_.normal[static_cast<int>(target) - static_cast<int>(Target::kNx)] = static_cast<float>(value);
      break;
  }
}

void PointCollector::end() {
  const float length = point_.normal.norm();
  if (!std::isfinite(length) || length == 0)
    point_.normal.setZero();
  else if (std::abs(length - 1) > 1e-5f)
    point_.normal /= length;
  if (point_.p.allFinite())
    cloud_.points.push_back(point_);
  else
    ++cloud_.invalid;
}

std::optional<std::string_view> TokenReader::next() {
  while (at_ < text_.size() && is_space(text_[at_])) line_ += text_[at_++] == '\n';
  if (at_ == text_.size()) return std::nullopt;
  const std::size_t begin = at_;
  while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

std::optional<double> TokenReader::number(std::string_view property) {
  const auto token = next();
  if (!token) return std::nullopt;
  const auto value = real_of(*token);
  if (!value)
    throw InputError(file_, line_, fmt::format("{}: found '{}', expected a number", property, token->substr(0, 40)));
  return value;
}

std::optional<double> real_of(std::string_view token) {
  if (token.starts_with('+')) token.remove_prefix(1);
  double value = 0;
  return parse_number(token, value) ? std::optional(value) : std::nullopt;
}

std::optional<std::size_t> count_of(std::string_view token) {
  std::size_t value = 0;
  return parse_number(token, value) ? std::optional(value) : std::nullopt;
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> out;
  for (std::size_t at = 0; at < line.size();) {
    while (at < line.size() && is_space(line[at])) ++at;
    const std::size_t begin = at;
    while (at < line.size() && !is_space(line[at])) ++at;
    if (at > begin) out.push_back(line.substr(begin, at - begin));
  }
  return out;
}

std::optional<std::string_view> take_line(std::string_view text, std::size_t& at) {
  if (at >= text.size()) return std::nullopt;
  const std::size_t end = std::min(text.find('\n', at), text.size());
  std::string_view line = text.substr(at, end - at);
  at = std::min(end + 1, text.size());
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::optional<std::string> frame_comment(std::string_view comment) {
  const auto parts = words(comment);
  if (parts.size() != 2 || parts[0] != "frame" || parts[1].size() != 1) return std::nullopt;
  return std::string(parts[1]);
}

void fail_truncated(const std::filesystem::path& file, std::size_t found, std::size_t expected) {
  throw InputError(file, fmt::format("data ends early: found {} points, expected {}", found, expected));
}

void append_point(std::string& out, const CloudPoint& point, bool ascii, bool with_normal) {
  const Eigen::Vector3f p = point.p.cast<float>();
  if (ascii) {
    fmt::format_to(std::back_inserter(out), "{} {} {} {} {} {} {}", p.x(), p.y(), p.z(), point.intensity, point.frame,
                   point.column, point.sigma);
    if (with_normal)
      fmt::format_to(std::back_inserter(out), " {} {} {}", point.normal.x(), point.normal.y(), point.normal.z());
    out += '\n';
    return;
  }
  const auto append = [&out](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (const float value : {p.x(), p.y(), p.z(), point.intensity}) append(value);
  append(point.frame);
  for (const float value : {point.column, point.sigma}) append(value);
  if (with_normal)
    for (const float value : point.normal) append(value);
}

}  // namespace tankrig::cloud_file
