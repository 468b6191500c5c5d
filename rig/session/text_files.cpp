#include "rig/session/text_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot_write(const fs::path& file, int error) {
  throw InputError(file, std::string("cannot be written: ") + std::strerror(error));
}

/// Takes from `text` what is written.
void write_all(const fs::path& file, int descriptor, std::string_view& text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      cannot_write(file, errno);
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

fs::path beside(const fs::path& file) {
  fs::path temporary = file;
  temporary += ".tmp";
  return temporary;
}

}  // namespace

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
      constexpr char kHex[] = "0123456789abcdef";
      out += "\\x", out += kHex[c >> 4 & 15], out += kHex[c & 15];
    } else
      out += c;
  }
  return out + '"';
}

void write_whole_file(const fs::path& file, std::string_view text) {
  const fs::path temporary = beside(file);
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) cannot_write(file, errno);
  try {
    write_all(file, descriptor, text);
  } catch (...) {
    ::close(descriptor);
    ::unlink(temporary.c_str());
    throw;
  }
  const bool closed = ::close(descriptor) == 0;
  if (!closed || ::rename(temporary.c_str(), file.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    cannot_write(file, error);
  }
}

std::string read_whole_file(const fs::path& file) { return read_regular_file(file, kMostTableBytes, "a file"); }

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

void sync_file_system(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::syncfs(descriptor);
  ::close(descriptor);
}

void copy_whole_file(const fs::path& from, const fs::path& to) {
  const fs::path temporary = beside(to);
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
  if (descriptor_ < 0) cannot_write(file_, errno);
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
