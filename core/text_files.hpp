// How the rig writes and reads its text files: numbers that read back exactly, tables that grow.
#pragma once

#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/atomic_file.hpp"

namespace tankrig {

/// Shortest text that reads back as exactly `value`. Sessions hash and compare these texts, so the notation (1e-04,
/// where {fmt} writes 0.0001) must stay.
std::string exact_text(double value);

/// A YAML double-quoted scalar.
std::string yaml_quoted(std::string_view text);

/// Errors: InputError if it cannot be read, is no regular file or has more than most_table_bytes().
std::string read_whole_file(const std::filesystem::path& file);

/// Whether a relative file name stays inside its folder.
bool stays_inside(const std::filesystem::path& name);

/// Whether `path`, existing or not, is `folder` or below it, with symbolic links followed.
bool lies_within(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Copies a file into place by a temporary file and a rename. Does not wait for the disk.
/// Errors: InputError naming both files.
void copy_whole_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// All of `text` as a number of type T.
template <class T>
bool parse_number(std::string_view text, T& value) {
  const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
  return ec == std::errc{} && end == text.data() + text.size();
}

/// A text file that only grows; flush() writes it.
/// Threads: one.
/// Errors: CannotWrite; the rest is kept, and a later flush continues at that byte.
class AppendFile {
 public:
  explicit AppendFile(std::filesystem::path file);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  void append(std::string_view text) { pending_ += text; }
  void flush();
  int descriptor() const { return descriptor_; }

 private:
  std::filesystem::path file_;
  std::string pending_;
  int descriptor_ = -1;
};

}  // namespace tankrig
