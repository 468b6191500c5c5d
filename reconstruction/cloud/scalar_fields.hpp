// The numbers of a cloud file: scalar types, tokens, and which of them belong to a point.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig::cloud_file {

enum class Scalar : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF32, kF64 };

std::size_t size_of(Scalar type);
/// Largest value of an integer type; 1 for floating point.
double full_scale(Scalar type);
/// The value whose bytes begin at `bytes`.
double decode(const char* bytes, Scalar type, bool big_endian);

/// Where a named property goes in a CloudPoint.
enum class Target : std::uint8_t { kNone, kX, kY, kZ, kIntensity, kFrame, kColumn, kSigma, kNx, kNy, kNz };
Target target_of(std::string_view property);
/// 'x' of kX, and so on to 'z'.
constexpr char axis_name(Target axis) {
  return static_cast<char>('x' + static_cast<int>(axis) - static_cast<int>(Target::kX));
}

/// Puts the properties of one point together and keeps it if its place is finite.
class PointCollector {
 public:
  explicit PointCollector(PointCloud& cloud) : cloud_(cloud) {}
  void begin() { point_ = CloudPoint{}; }
  void set(Target target, Scalar type, double value);
  void end();

 private:
  PointCloud& cloud_;
  CloudPoint point_;
};

/// Whitespace-separated tokens with their lines.
class TokenReader {
 public:
  TokenReader(const std::filesystem::path& file, std::string_view text, int first_line)
      : file_(file), text_(text), line_(first_line) {}
  /// Next token; nothing at the end of the text.
  std::optional<std::string_view> next();
  /// Next token as a number ("nan" and "inf" are numbers); nothing at the end.
  /// Errors: InputError naming line and property.
  std::optional<double> number(std::string_view property);

 private:
  const std::filesystem::path& file_;
  std::string_view text_;
  std::size_t at_ = 0;
  int line_;
};

std::optional<double> real_of(std::string_view token);
std::optional<std::size_t> count_of(std::string_view token);
std::vector<std::string_view> words(std::string_view line);

/// Takes one header line, without its end, off `text` from `at` on; nothing at the end of the text.
std::optional<std::string_view> take_line(std::string_view text, std::size_t& at);

/// The letter of a header comment "frame LETTER"; nothing if the comment says something else.
std::optional<std::string> frame_comment(std::string_view comment);

/// "found N points, expected M".
[[noreturn]] void fail_truncated(const std::filesystem::path& file, std::size_t found, std::size_t expected);

/// x y z intensity frame column sigma, then the normal if asked for: 28 or 40 bytes, little endian, or one line of text.
void append_point(std::string& out, const CloudPoint& point, bool ascii, bool with_normal);

// One pair per format; `text` is the whole file.
PointCloud read_ply(const std::filesystem::path& file, std::string_view text);
PointCloud read_pcd(const std::filesystem::path& file, std::string_view text);
std::string ply_text(const PointCloud& cloud, bool ascii);
std::string pcd_text(const PointCloud& cloud, bool ascii);

}  // namespace tankrig::cloud_file
