#include "core/text_files.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/regular_file.hpp"

namespace tankrig {

namespace fs = std::filesystem;

std::string exact_text(double value) {
  char buffer[32];
  const auto [end, ec] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, end);
}

std::string yaml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += '\\', out += c;
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\x{:02x}", c);
    } else
      out += c;
  }
  return out + '"';
}

std::string read_whole_file(const fs::path& file) { return read_regular_file(file, most_table_bytes(), "a file"); }

bool stays_inside(const fs::path& name) {
  if (name.empty() || name.is_absolute()) return false;
  for (const fs::path& part : name)
    if (part == "..") return false;
  return true;
}

bool lies_within(const fs::path& path, const fs::path& folder) {
  const fs::path inner = fs::weakly_canonical(fs::absolute(path)), outer = fs::weakly_canonical(fs::absolute(folder));
  const auto end = outer.has_filename() ? outer.end() : std::prev(outer.end());
  return std::mismatch(outer.begin(), end, inner.begin(), inner.end()).first == end;
}

void copy_whole_file(const fs::path& from, const fs::path& to) {
  const fs::path temporary = to.string() + kUnfinished;
  std::error_code failed;
  fs::copy_file(from, temporary, fs::copy_options::overwrite_existing, failed);
  if (!failed) fs::rename(temporary, to, failed);
  if (failed) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw InputError(from, "cannot be copied to " + to.string() + ": " + failed.message());
  }
}

AppendFile::AppendFile(fs::path file) : file_(std::move(file)) {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw CannotWrite(file_, errno);
}

AppendFile::~AppendFile() { ::close(descriptor_); }

void AppendFile::flush() {
  std::string_view left = pending_;
  try {
    write_all(file_, descriptor_, left);
  } catch (...) {
    pending_.erase(0, pending_.size() - left.size());
    throw;
  }
  pending_.clear();
}

}  // namespace tankrig
