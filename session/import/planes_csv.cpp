#include "session/import/planes_csv.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>
#include <vector>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/plausible_length.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
  return text;
}

Plane plane_of(const std::vector<std::string>& fields, std::size_t first) {
  if (fields.size() != first + 4)
    throw InputError(fmt::format("found {} numbers, expected a,b,c,d", fields.size() - first));
  double v[4];
  for (std::size_t i = 0; i < 4; ++i) {
    std::string_view text = trimmed(fields[first + i]);
    if (text.starts_with('+')) text.remove_prefix(1);
    if (!parse_number(text, v[i]) || !std::isfinite(v[i]))
      throw InputError("found '" + shown_text(fields[first + i]) + "', expected a number");
  }
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(length > 1e-9)) throw InputError("found a normal a,b,c of length 0, expected a direction");
  if (!plausible_length(v[3] / length))
    throw InputError("found d = " + shown_text(fields[first + 3]) + kLooksLikeMillimetres);
  return {Vector3d(v[0], v[1], v[2]) / length, v[3] / length};
}

Plane laser_plane_of(const std::vector<std::string>& fields, std::size_t first) {
  const Plane plane = plane_of(fields, first);
  if (std::abs(plane.offset) < 1e-6)
    throw InputError("found d = " + shown_text(fields[first + 3]) +
                     ", a plane through the camera's centre; expected a distance from it");
  return plane;
}

constexpr std::array kPlaneColumns{"file", "a", "b", "c", "d"};
constexpr const char* kPlaneHeader = "file,a,b,c,d";

/// Where file, a, b, c, d stand in a line of planes.
using PlaneColumns = std::array<std::size_t, kPlaneColumns.size()>;

/// A line is a header if it names the column `file`, or if nothing in it is a number.
bool is_planes_header(const std::vector<std::string>& fields) {
  const auto is_file = [](const std::string& field) { return trimmed(field) == "file"; };
  const auto is_number = [](const std::string& field) {
    double ignored = 0;
    return parse_number(trimmed(field), ignored);
  };
  return std::any_of(fields.begin(), fields.end(), is_file) || std::none_of(fields.begin(), fields.end(), is_number);
}

PlaneColumns read_planes_header(const std::vector<std::string>& fields) {
  PlaneColumns columns;
  columns.fill(fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto name = std::find(kPlaneColumns.begin(), kPlaneColumns.end(), trimmed(fields[i]));
    const std::string found = fmt::format("column {}: found '{}'", i + 1, shown_text(trimmed(fields[i])));
    if (name == kPlaneColumns.end()) throw InputError(found + ", expected exactly the columns " + kPlaneHeader);
    std::size_t& column = columns[static_cast<std::size_t>(name - kPlaneColumns.begin())];
    if (column != fields.size()) throw InputError(found + " for the second time, expected the columns " + kPlaneHeader);
    column = i;
  }
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (columns[i] == fields.size())
      throw InputError(fmt::format("found no column '{}', expected the columns {}", kPlaneColumns[i], kPlaneHeader));
  return columns;
}

}  // namespace

Plane parse_plane(std::string_view text) {
  try {
    return plane_of(split_csv_line(text), 0);
  } catch (const InputError& e) {
    throw InputError("plane '" + std::string(text) + "': " + e.what());
  }
}

Plane parse_laser_plane(std::string_view text) {
  try {
    return laser_plane_of(split_csv_line(text), 0);
  } catch (const InputError& e) {
    throw InputError("plane '" + std::string(text) + "': " + e.what());
  }
}

std::map<std::string, Plane> read_planes_csv(const fs::path& file) {
  const std::string text = read_whole_file(file);
  std::map<std::string, Plane> planes;
  PlaneColumns columns{0, 1, 2, 3, 4};
  int line_number = 0;
  bool first = true;
  for (std::size_t begin = text.starts_with("\xef\xbb\xbf") ? 3 : 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line(trimmed(std::string_view(text).substr(begin, end - begin)));
    begin = end + 1, ++line_number;
    if (line.empty() || line.starts_with('#')) continue;
    const std::vector<std::string> fields = split_csv_line(line);
    try {
      if (std::exchange(first, false) && is_planes_header(fields)) {
        columns = read_planes_header(fields);
        continue;
      }
      if (fields.size() != columns.size())
        throw InputError(fmt::format("found {} fields, expected {}: {}", fields.size(), columns.size(), kPlaneHeader));
      std::vector<std::string> ordered;
      for (const std::size_t column : columns) ordered.push_back(fields[column]);
      const std::string name(trimmed(ordered[0]));
      if (name.empty()) throw InputError(std::string("found no file name, expected ") + kPlaneHeader);
      if (!planes.emplace(name, laser_plane_of(ordered, 1)).second)
        throw InputError("found '" + shown_text(name) + "' for the second time, expected it once");
    } catch (const InputError& e) {
      throw InputError(file, line_number, e.what());
    }
  }
  if (planes.empty()) throw InputError(file, "holds no plane, expected lines file,a,b,c,d");
  return planes;
}

}  // namespace tankrig
