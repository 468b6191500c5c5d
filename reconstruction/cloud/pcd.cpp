// PCD: a header of fields with size, type and count, then points as text, as records, or as packed columns.

#include <fmt/core.h>

#include <cstring>

#include "core/input_error.hpp"
#include "reconstruction/cloud/lzf.hpp"
#include "reconstruction/cloud/scalar_fields.hpp"

namespace tankrig::cloud_file {
namespace {

struct Field {
  std::string name;
  Scalar type = Scalar::kF32;
  std::size_t count = 1;
  Target target = Target::kNone;

  std::size_t bytes() const { return size_of(type) * count; }
};

struct PcdHeader {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::string data;  ///< ascii, binary or binary_compressed
  std::string frame;
  std::size_t offset = 0;
  int lines = 0;

  std::size_t point_bytes() const {
    std::size_t sum = 0;
    for (const Field& field : fields) sum += field.bytes();
    return sum;
  }
};

std::optional<Scalar> scalar_of(char kind, std::size_t size) {
  const bool is_signed = kind == 'I';
  if (kind == 'F')
    return size == 4 ? std::optional(Scalar::kF32) : size == 8 ? std::optional(Scalar::kF64) : std::nullopt;
  if (kind != 'I' && kind != 'U') return std::nullopt;
  switch (size) {
    case 1:
      return is_signed ? Scalar::kI8 : Scalar::kU8;
    case 2:
      return is_signed ? Scalar::kI16 : Scalar::kU16;
    case 4:
      return is_signed ? Scalar::kI32 : Scalar::kU32;
    case 8:
      return is_signed ? Scalar::kI64 : Scalar::kU64;
    default:
      return std::nullopt;
  }
}

class PcdHeaderReader {
 public:
  PcdHeaderReader(const std::filesystem::path& file, std::string_view text) : file_(file), text_(text) {}

  PcdHeader read() {
    while (header_.data.empty()) {
      const auto line = take_line(text_, at_);
      ++line_number_;
      if (!line) fail("header ends early, expected a DATA line");
      if (line->starts_with('#')) {
        if (const auto frame = frame_comment(line->substr(1))) header_.frame = *frame;
        continue;
      }
      const auto parts = words(*line);
      if (!parts.empty()) read_entry(parts);
    }
    header_.offset = at_;
    header_.lines = line_number_;
    finish();
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw InputError(file_, line_number_, message); }

  void read_entry(const std::vector<std::string_view>& parts) {
    const std::string_view key = parts[0];
    if (key == "FIELDS" || key == "COLUMNS") {
      for (std::size_t i = 1; i < parts.size(); ++i)
        header_.fields.push_back({std::string(parts[i]), Scalar::kF32, 1, target_of(parts[i])});
    } else if (key == "SIZE") {
      sizes_ = numbers(parts);
    } else if (key == "TYPE") {
      for (std::size_t i = 1; i < parts.size(); ++i) kinds_.push_back(parts[i][0]);
    } else if (key == "COUNT") {
      counts_ = numbers(parts);
    } else if (key == "WIDTH") {
      width_ = one_number(parts);
    } else if (key == "HEIGHT") {
      height_ = one_number(parts);
    } else if (key == "POINTS") {
      points_ = one_number(parts);
    } else if (key == "DATA") {
      header_.data = parts.size() == 2 ? std::string(parts[1]) : "";
      if (header_.data != "ascii" && header_.data != "binary" && header_.data != "binary_compressed")
        fail("DATA: found '" + header_.data + "', expected ascii, binary or binary_compressed");
    } else if (key != "VERSION" && key != "VIEWPOINT") {
      fail("found '" + std::string(key.substr(0, 40)) + "', expected a PCD header entry such as FIELDS or DATA");
    }
  }

  std::vector<std::size_t> numbers(const std::vector<std::string_view>& parts) const {
    std::vector<std::size_t> out;
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const auto value = count_of(parts[i]);
      if (!value) fail(fmt::format("{}: found '{}', expected a whole number", parts[0], parts[i].substr(0, 40)));
      out.push_back(*value);
    }
    return out;
  }

  std::size_t one_number(const std::vector<std::string_view>& parts) const {
    const auto all = numbers(parts);
    if (all.size() != 1) fail(fmt::format("{}: found {} values, expected 1", parts[0], all.size()));
    return all[0];
  }

  void finish() {
    const std::size_t n = header_.fields.size();
    if (counts_.empty()) counts_.assign(n, 1);
    check_length("SIZE", sizes_.size(), n);
    check_length("TYPE", kinds_.size(), n);
    check_length("COUNT", counts_.size(), n);
    for (std::size_t i = 0; i < n; ++i) {
      Field& field = header_.fields[i];
      const auto type = scalar_of(kinds_[i], sizes_[i]);
      if (!type)
        throw InputError(
            file_, fmt::format("field {}: found type {} of size {}, expected F 4 or 8, I or U 1, 2, 4 or 8", field.name,
                               kinds_[i], sizes_[i]));
      field.type = *type;
      constexpr std::size_t kMaxCount = 1000000;
      if (counts_[i] > kMaxCount)
        throw InputError(file_, fmt::format("COUNT: found {}, expected at most {}", counts_[i], kMaxCount));
      field.count = counts_[i];
    }
    for (const Target needed : {Target::kX, Target::kY, Target::kZ}) {
      bool found = false;
      for (const Field& field : header_.fields) found |= field.target == needed && field.count > 0;
      if (!found) throw InputError(file_, fmt::format("FIELDS: found no '{}', expected x, y and z", axis_name(needed)));
    }
    if (!points_ && !width_) throw InputError(file_, "found neither POINTS nor WIDTH, expected the number of points");
    header_.points = points_ ? *points_ : *width_ * height_.value_or(1);
  }

  void check_length(const char* entry, std::size_t found, std::size_t expected) const {
    if (found != expected)
      throw InputError(file_, fmt::format("{}: found {} values, expected {} as in FIELDS", entry, found, expected));
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  std::size_t at_ = 0;
  int line_number_ = 0;
  std::vector<std::size_t> sizes_, counts_;
  std::vector<char> kinds_;
  std::optional<std::size_t> width_, height_, points_;
  PcdHeader header_;
};

void read_ascii(const std::filesystem::path& file, const PcdHeader& header, std::string_view data, PointCloud& cloud) {
  TokenReader tokens(file, data, header.lines + 1);
  PointCollector points(cloud);
  for (std::size_t i = 0; i < header.points; ++i) {
    points.begin();
    for (const Field& field : header.fields)
      for (std::size_t k = 0; k < field.count; ++k) {
        const auto value = tokens.number(field.name);
        if (!value) fail_truncated(file, i, header.points);
        if (k == 0) points.set(field.target, field.type, *value);
      }
    points.end();
  }
}

void read_records(const std::filesystem::path& file, const PcdHeader& header, std::string_view data,
                  PointCloud& cloud) {
  const std::size_t stride = header.point_bytes();
  if (data.size() / stride < header.points) fail_truncated(file, data.size() / stride, header.points);
  PointCollector points(cloud);
  for (std::size_t i = 0; i < header.points; ++i) {
    points.begin();
    const char* at = data.data() + i * stride;
    for (const Field& field : header.fields) {
      if (field.count > 0) points.set(field.target, field.type, decode(at, field.type, false));
      at += field.bytes();
    }
    points.end();
  }
}

void read_columns(const std::filesystem::path& file, const PcdHeader& header, std::string_view data,
                  PointCloud& cloud) {
  if (header.points == 0) return;
  if (data.size() < 8) fail_truncated(file, 0, header.points);
  const auto packed_size = static_cast<std::size_t>(decode(data.data(), Scalar::kU32, false));
  const auto size = static_cast<std::size_t>(decode(data.data() + 4, Scalar::kU32, false));
  if (size / header.points != header.point_bytes())
    throw InputError(file, fmt::format("binary_compressed: found {} bytes, expected {} for each of {} points", size,
                                       header.point_bytes(), header.points));
  if (data.size() - 8 < packed_size)
    throw InputError(
        file, fmt::format("data ends early: found {} compressed bytes, expected {}", data.size() - 8, packed_size));
  const auto columns = lzf_unpack(data.substr(8, packed_size), size);
  if (!columns)
    throw InputError(file, fmt::format("binary_compressed: found damaged LZF data, expected {} bytes of it", size));
  PointCollector points(cloud);
  for (std::size_t i = 0; i < header.points; ++i) {
    points.begin();
    const char* column = columns->data();
    for (const Field& field : header.fields) {
      if (field.count > 0) points.set(field.target, field.type, decode(column + i * field.bytes(), field.type, false));
      column += field.bytes() * header.points;
    }
    points.end();
  }
}

}  // namespace

PointCloud read_pcd(const std::filesystem::path& file, std::string_view text) {
  const PcdHeader header = PcdHeaderReader(file, text).read();
  const std::string_view data = text.substr(header.offset);
  PointCloud cloud;
  cloud.frame = header.frame;
  if (header.data == "ascii")
    read_ascii(file, header, data, cloud);
  else if (header.data == "binary")
    read_records(file, header, data, cloud);
  else
    read_columns(file, header, data, cloud);
  return cloud;
}

std::string pcd_text(const PointCloud& cloud, bool ascii) {
  const bool normals = cloud.has_normals();
  std::string out = fmt::format(
      "# .PCD v0.7 - tankrig cloud: x y z and sigma in metres, intensity 0..1, column in pixels\n"
      "# frame {0}\n"
      "VERSION 0.7\n"
      "FIELDS x y z intensity frame column sigma{3}\n"
      "SIZE 4 4 4 4 4 4 4{4}\n"
      "TYPE F F F F I F F{5}\n"
      "COUNT 1 1 1 1 1 1 1{6}\n"
      "WIDTH {1}\n"
      "HEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\n"
      "POINTS {1}\n"
      "DATA {2}\n",
      cloud.frame, cloud.points.size(), ascii ? "ascii" : "binary", normals ? " normal_x normal_y normal_z" : "",
      normals ? " 4 4 4" : "", normals ? " F F F" : "", normals ? " 1 1 1" : "");
  for (const CloudPoint& point : cloud.points) append_point(out, point, ascii, normals);
  return out;
}

}  // namespace tankrig::cloud_file
