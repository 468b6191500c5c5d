#include "session/recording/spool.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "session/checking/crc32.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "TANKFRM1";
constexpr std::size_t kHeaderBytes = 40;
constexpr std::uint64_t kMostSegmentBytes = 1 << 30;  // the recorder begins another one after 32 MiB
constexpr std::uint32_t kMaxLine = 1 << 16, kMaxSide = 1 << 16;

template <class T>
void put(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out += static_cast<char>(value >> 8 * i & 0xff);
}

template <class T>
T get(std::string_view bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i)
    value |= static_cast<T>(static_cast<unsigned char>(bytes[at + i])) << 8 * i;
  return value;
}

std::string_view pixels(const cv::Mat& image) {
  return {reinterpret_cast<const char*>(image.data), image.total() * image.elemSize()};
}

[[noreturn]] void cannot_read(const fs::path& file) {
  throw InputError(file, std::string("cannot be read: ") + std::strerror(errno));
}

/// Bytes of the record that begins here, if its header is whole and says so; else 0.
std::uint64_t record_bytes(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || !bytes.starts_with(kMagic)) return 0;
  if (crc32(bytes.substr(0, 36)) != get<std::uint32_t>(bytes, 36)) return 0;
  const std::uint64_t line = get<std::uint32_t>(bytes, 16), rows = get<std::uint32_t>(bytes, 20),
                      cols = get<std::uint32_t>(bytes, 24), channels = get<std::uint32_t>(bytes, 28);
  if (line > kMaxLine || rows > kMaxSide || cols > kMaxSide || (channels != 1 && channels != 3)) return 0;
  return kHeaderBytes + line + rows * cols * channels;
}

}  // namespace

fs::path spool_folder(const fs::path& session) { return session / "spool"; }

bool has_spool(const fs::path& session) {
  std::error_code ignored;
  return fs::is_directory(spool_folder(session), ignored);
}

std::vector<fs::path> spool_segments(const fs::path& session) {
  std::vector<fs::path> segments;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(spool_folder(session), none))
    if (entry.path().extension() == ".raw") segments.push_back(entry.path());
  std::sort(segments.begin(), segments.end());
  return segments;
}

std::string spool_record_head(std::uint64_t number, std::string_view line, const cv::Mat& image) {
  std::string head(kMagic);
  put(head, number);
  put(head, static_cast<std::uint32_t>(line.size()));
  put(head, static_cast<std::uint32_t>(image.rows));
  put(head, static_cast<std::uint32_t>(image.cols));
  put(head, static_cast<std::uint32_t>(image.channels()));
  put(head, crc32(pixels(image), crc32(line)));
  put(head, crc32(head));
  return head.append(line);
}

SpoolWriter::SpoolWriter(fs::path file) : file_(std::move(file)) {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw CannotWrite(file_, errno);
}

SpoolWriter::~SpoolWriter() { ::close(descriptor_); }

void SpoolWriter::append(std::uint64_t number, std::string_view line, const cv::Mat& image) {
  std::string head = spool_record_head(number, line, image);
  std::array<iovec, 2> parts{iovec{head.data(), head.size()}, iovec{image.data, image.total() * image.elemSize()}};
  std::size_t part = 0;
  std::uint64_t done = 0;
  while (part < parts.size()) {
    const ssize_t written = ::writev(descriptor_, &parts[part], static_cast<int>(parts.size() - part));
    if (written < 0) {
      if (errno == EINTR) continue;
      const int error = errno;
      if (::ftruncate(descriptor_, static_cast<off_t>(bytes_)) == 0)
        ::lseek(descriptor_, static_cast<off_t>(bytes_), SEEK_SET);
      else
        bytes_ += done;
      throw CannotWrite(file_, error);
    }
    done += static_cast<std::uint64_t>(written);
    for (auto left = static_cast<std::size_t>(written); part < parts.size();) {
      const std::size_t step = std::min(left, parts[part].iov_len);
      parts[part].iov_base = static_cast<char*>(parts[part].iov_base) + step;
      parts[part].iov_len -= step;
      left -= step;
      if (parts[part].iov_len > 0) break;
      ++part;
    }
  }
  bytes_ += done;
}

SpoolSegment::SpoolSegment(const fs::path& file) {
  const int descriptor = open_regular_file(file, kMostSegmentBytes, "a segment of the spool");
  struct stat status {};
  const bool known = ::fstat(descriptor, &status) == 0;
  size_ = known ? static_cast<std::size_t>(status.st_size) : 0;
  if (size_ > 0) bytes_ = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE, descriptor, 0);
  const bool mapped = known && bytes_ != MAP_FAILED;
  const int error = errno;
  ::close(descriptor);
  errno = error;
  if (!mapped) {
    bytes_ = nullptr;
    cannot_read(file);
  }
  find_records({static_cast<const char*>(bytes_), size_});
}

SpoolSegment::~SpoolSegment() {
  frames_.clear();
  if (bytes_) ::munmap(bytes_, size_);
}

void SpoolSegment::find_records(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::uint64_t length = record_bytes(bytes);
    if (length > 0 && length <= bytes.size()) {
      const std::uint32_t line_bytes = get<std::uint32_t>(bytes, 16);
      const std::string_view body = bytes.substr(kHeaderBytes, length - kHeaderBytes);
      if (crc32(body) == get<std::uint32_t>(bytes, 32)) {
        char* const at = static_cast<char*>(bytes_) + (size_ - bytes.size()) + kHeaderBytes + line_bytes;
        const int type = get<std::uint32_t>(bytes, 28) == 1 ? CV_8UC1 : CV_8UC3;
        frames_.push_back({get<std::uint64_t>(bytes, 8), std::string(body.substr(0, line_bytes)),
                           cv::Mat(static_cast<int>(get<std::uint32_t>(bytes, 20)),
                                   static_cast<int>(get<std::uint32_t>(bytes, 24)), type, at)});
        bytes.remove_prefix(length);
        continue;
      }
    }
    const std::size_t next = std::min(bytes.find(kMagic, 1), bytes.size());
    stray_bytes_ += next;
    bytes.remove_prefix(next);
  }
}

}  // namespace tankrig
