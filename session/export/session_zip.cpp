#include "session/export/session_zip.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <utility>

#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "session/checking/crc32.hpp"
#include "session/recording/session_lock.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

constexpr std::size_t kPiece = 64 << 10;
constexpr std::size_t kMostFiles = 1'000'000;  // a scan of a day has fewer
constexpr double kTimesStep_ns = 20e6;         // of file systems, at most; 4 ms are usual
constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kMost16 = std::numeric_limits<std::uint16_t>::max();
constexpr std::uint64_t kNeeds = 20, kNeeds64 = 45;  // the version that reads it: 2.0, and 4.5 for ZIP64
constexpr std::uint64_t kFlags = 0x0808;             // UTF-8; CRC and sizes follow the data
constexpr std::uint64_t kUnix = 3, kMode = 0100644;  // a plain file that its owner may write

constexpr std::size_t kHeader = 30, kDescriptor = 16, kDescriptor64 = 24, kEntry = 46, kEnd = 22, kEnd64 = 56,
                      kLocator = 20, kExtra = 4;

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i));
}

/// Date and time as DOS has them, in UTC, to 2 s.
std::uint64_t dos_time(std::int64_t seconds) {
  const std::time_t time = std::clamp<std::int64_t>(seconds, 315'532'800, 4'354'819'198);  // 1980 to 2107
  std::tm t{};
  ::gmtime_r(&time, &t);
  const auto part = [](int value, int shift) { return static_cast<std::uint64_t>(value) << shift; };
  return part(t.tm_year - 80, 25) | part(t.tm_mon + 1, 21) | part(t.tm_mday, 16) | part(t.tm_hour, 11) |
         part(t.tm_min, 5) | part(t.tm_sec / 2, 0);
}

/// What a directory's entry cannot hold in 32 bits, in the order of ZIP64's extra field.
std::vector<std::uint64_t> large_values(std::uint64_t size, std::uint64_t offset) {
  std::vector<std::uint64_t> large;
  if (size >= kMost32) large.insert(large.end(), 2, size);
  if (offset >= kMost32) large.push_back(offset);
  return large;
}

std::size_t extra_bytes(const std::vector<std::uint64_t>& large) {
  return large.empty() ? 0 : kExtra + 8 * large.size();
}

/// A name that means the same wherever it is unpacked.
void expect_plain(const fs::path& session, const std::string& name) {
  const bool other =
      find_unprintable(name) != std::string::npos || name.find_first_of("\t\n\r\\:*?\"<>|") != std::string::npos;
  if (other || name.size() > kMost16 / 2)
    throw InputError(session, "holds the name '" + shown_text(name) + "', expected one that every system can read");
}

}  // namespace

SessionZip::Seen SessionZip::seen(const struct stat& s) {
  return {s.st_dev, s.st_ino, s.st_size, s.st_ctim.tv_sec, s.st_ctim.tv_nsec, s.st_mtim.tv_sec, s.st_mtim.tv_nsec};
}

SessionZip::SessionZip(const fs::path& session) : session_(session), prefix_(session.filename().string() + "/") {
  const SessionLock at_rest(session_, SessionUse::kRead, Duration{});
  if (!fs::is_regular_file(fs::symlink_status(session_ / "session.yaml")))
    throw InputError(session_, "has no session.yaml, expected a session");
  expect_plain(session_, prefix_);
  look({});
  expect_old();
  std::ranges::sort(files_, {}, &File::name);
  lay_out();
}

SessionZip::~SessionZip() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void SessionZip::look(const fs::path& folder) {
  struct stat status {};
  if (::lstat((session_ / folder).c_str(), &status) != 0 || !S_ISDIR(status.st_mode))
    throw InputError(session_ / folder, "is no folder any more");
  folders_.emplace_back(folder.string(), seen(status));
  for (const fs::directory_entry& entry : fs::directory_iterator(session_ / folder)) {
    const fs::path name = folder / entry.path().filename();
    if (name.extension() == kUnfinished) continue;
    expect_plain(session_, name.string());
    if (::lstat(entry.path().c_str(), &status) != 0)
      throw InputError(entry.path(), std::string("cannot be looked at: ") + std::strerror(errno));
    if (S_ISDIR(status.st_mode))
      look(name);
    else if (S_ISREG(status.st_mode) && files_.size() < kMostFiles)
      files_.push_back({name.string(), seen(status)});
    else if (S_ISREG(status.st_mode))
      throw InputError(session_, "holds more than a million files, expected a session");
    else
      throw InputError(entry.path(), "is a link, a pipe or a device, expected files and folders alone");
  }
}

void SessionZip::expect_old() const {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const auto fresh = [&](const Seen& seen) {
    return std::abs((now.tv_sec - seen.changed_s) * 1e9 + static_cast<double>(now.tv_nsec - seen.changed_ns)) <
           kTimesStep_ns;
  };
  if (std::ranges::any_of(files_, fresh, &File::seen) ||
      std::ranges::any_of(folders_, [&](const auto& folder) { return fresh(folder.second); }))
    throw InputError(session_, "has changed just now, expected a session at rest");
}

void SessionZip::lay_out() {
  for (File& file : files_) {
    const auto size = static_cast<std::uint64_t>(file.seen.size);
    const std::size_t name = prefix_.size() + file.name.size();
    file.offset = central_;
    central_ += kHeader + name + size;
    central_ += size >= kMost32 ? kExtra + 16 + kDescriptor64 : kDescriptor;
    central_bytes_ += kEntry + name + extra_bytes(large_values(size, file.offset));
  }
  const bool large = files_.size() >= kMost16 || central_ >= kMost32 || central_bytes_ >= kMost32;
  bytes_ = central_ + central_bytes_ + (large ? kEnd64 + kLocator : 0) + kEnd;
}

std::string SessionZip::next() {
  std::string piece;
  while (piece.size() < kPiece && !ended_) step(piece);
  return piece;
}

void SessionZip::step(std::string& piece) {
  if (descriptor_ >= 0) return read(files_[sent_], piece);
  if (sent_ < files_.size()) {
    const File& file = files_[sent_];
    open(file);
    const bool large = left_ >= kMost32;
    put(piece, 0x04034b50, 4);
    put(piece, large ? kNeeds64 : kNeeds, 2);
    put(piece, kFlags, 2);
    put(piece, 0, 2);  // stored
    put(piece, dos_time(file.seen.written_s), 4);
    put(piece, 0, 4);                                                // CRC: follows
    for (int i = 0; i < 2; ++i) put(piece, large ? kMost32 : 0, 4);  // sizes: follow
    put(piece, prefix_.size() + file.name.size(), 2);
    put(piece, large ? kExtra + 16 : 0, 2);
    piece += prefix_ + file.name;
    if (!large) return;
    put(piece, 1, 2);
    put(piece, 16, 2);
    put(piece, 0, 8), put(piece, 0, 8);
    return;
  }
  if (listed_ < files_.size()) {
    const File& file = files_[listed_++];
    expect_same(file.name, file.seen);
    const auto size = static_cast<std::uint64_t>(file.seen.size);
    const std::vector<std::uint64_t> large = large_values(size, file.offset);
    put(piece, 0x02014b50, 4);
    put(piece, kUnix << 8 | kNeeds64, 2);
    put(piece, large.empty() ? kNeeds : kNeeds64, 2);
    put(piece, kFlags, 2);
    put(piece, 0, 2);
    put(piece, dos_time(file.seen.written_s), 4);
    put(piece, file.crc, 4);
    for (int i = 0; i < 2; ++i) put(piece, std::min(size, kMost32), 4);
    put(piece, prefix_.size() + file.name.size(), 2);
    put(piece, extra_bytes(large), 2);
    put(piece, 0, 2);  // comment
    put(piece, 0, 2);  // disk
    put(piece, 0, 2);  // a text? nobody asks
    put(piece, kMode << 16, 4);
    put(piece, std::min(file.offset, kMost32), 4);
    piece += prefix_ + file.name;
    if (large.empty()) return;
    put(piece, 1, 2);
    put(piece, 8 * large.size(), 2);
    for (const std::uint64_t value : large) put(piece, value, 8);
    return;
  }
  for (const auto& [folder, before] : folders_) expect_same(folder, before);
  end(piece);
  ended_ = true;
}

void SessionZip::open(const File& file) {
  descriptor_ = ::open((session_ / file.name).c_str(), kReadWithoutWaiting | O_NOFOLLOW);
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0 || seen(status) != file.seen)
    throw InputError(session_ / file.name, "is not any more as it was, expected a session at rest");
  left_ = static_cast<std::uint64_t>(file.seen.size);
}

void SessionZip::read(File& file, std::string& piece) {
  const std::size_t from = piece.size(), wanted = std::min<std::uint64_t>(left_, kPiece);
  piece.resize(from + wanted);
  const ssize_t n = wanted == 0 ? 0 : ::read(descriptor_, piece.data() + from, wanted);
  if (n < 0 && errno != EINTR)
    throw InputError(session_ / file.name, std::string("cannot be read: ") + std::strerror(errno));
  if (n == 0 && wanted > 0)
    throw InputError(session_ / file.name, "is shorter than it was, expected a session at rest");
  piece.resize(from + static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  file.crc = crc32(std::string_view(piece).substr(from), file.crc);
  left_ -= piece.size() - from;
  if (left_ > 0) return;
  struct stat status {};
  const bool same = ::fstat(descriptor_, &status) == 0 && seen(status) == file.seen;
  ::close(std::exchange(descriptor_, -1));
  if (!same) throw InputError(session_ / file.name, "has changed while it was read, expected a session at rest");
  const auto size = static_cast<std::uint64_t>(file.seen.size);
  put(piece, 0x08074b50, 4);
  put(piece, file.crc, 4);
  for (int i = 0; i < 2; ++i) put(piece, size, size >= kMost32 ? 8 : 4);
  ++sent_;
}

void SessionZip::expect_same(const std::string& name, const Seen& before) const {
  struct stat status {};
  if (::lstat((session_ / name).c_str(), &status) != 0 || seen(status) != before)
    throw InputError(session_ / name, "has changed meanwhile, expected a session at rest");
}

void SessionZip::end(std::string& piece) const {
  const std::uint64_t count = files_.size();
  if (count >= kMost16 || central_ >= kMost32 || central_bytes_ >= kMost32) {
    put(piece, 0x06064b50, 4);
    put(piece, kEnd64 - 12, 8);
    put(piece, kUnix << 8 | kNeeds64, 2);
    put(piece, kNeeds64, 2);
    put(piece, 0, 4), put(piece, 0, 4);  // disks
    put(piece, count, 8), put(piece, count, 8);
    put(piece, central_bytes_, 8);
    put(piece, central_, 8);
    put(piece, 0x07064b50, 4);
    put(piece, 0, 4);
    put(piece, central_ + central_bytes_, 8);
    put(piece, 1, 4);
  }
  put(piece, 0x06054b50, 4);
  put(piece, 0, 2), put(piece, 0, 2);
  for (int i = 0; i < 2; ++i) put(piece, std::min(count, kMost16), 2);
  put(piece, std::min(central_bytes_, kMost32), 4);
  put(piece, std::min(central_, kMost32), 4);
  put(piece, 0, 2);
}

}  // namespace tankrig
