// The spool: raw frames on disk, one record after the other, until they are pictures.
//
//   SESSION/spool/NNNNNN.raw, in the order they were written. A record, little-endian, without padding:
//    0  "TANKFRM1"
//    8  u64 number of the frame in this session, from 0
//   16  u32 line_bytes, u32 rows, u32 cols, u32 channels (1 or 3)
//   32  u32 CRC-32 of line and pixels
//   36  u32 CRC-32 of bytes 0 to 35
//   40  the frame's line of frames.csv, then the pixels, row by row
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace tankrig {

/// A segment of this size is followed by the next.
inline constexpr std::uint64_t kSegmentBytes = 32 << 20;

std::filesystem::path spool_folder(const std::filesystem::path& session);
/// Whether there are frames that are not pictures yet.
bool has_spool(const std::filesystem::path& session);
/// Its segments in order.
std::vector<std::filesystem::path> spool_segments(const std::filesystem::path& session);

/// Header and line of a record; the pixels follow. `image` is continuous, of 8 bits and 1 or 3 channels.
std::string spool_record_head(std::uint64_t number, std::string_view line, const cv::Mat& image);

/// A segment being written.
/// Threads: one.
/// Errors: InputError with the system's reason; the torn record is cut off again.
class SpoolWriter {
 public:
  explicit SpoolWriter(std::filesystem::path file);
  ~SpoolWriter();
  SpoolWriter(const SpoolWriter&) = delete;
  SpoolWriter& operator=(const SpoolWriter&) = delete;

  void append(std::uint64_t number, std::string_view line, const cv::Mat& image);
  std::uint64_t bytes() const { return bytes_; }
  int descriptor() const { return descriptor_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
};

/// A whole record of a segment.
struct SpooledFrame {
  std::uint64_t number = 0;
  std::string line;
  cv::Mat image;  ///< the segment's own bytes
};

/// A segment read back: every whole record, also behind a damaged one.
/// Errors: InputError if it cannot be read.
class SpoolSegment {
 public:
  explicit SpoolSegment(const std::filesystem::path& file);
  ~SpoolSegment();
  SpoolSegment(const SpoolSegment&) = delete;
  SpoolSegment& operator=(const SpoolSegment&) = delete;

  const std::vector<SpooledFrame>& frames() const { return frames_; }
  /// Bytes of no whole record: cut at the end, or damaged in the middle.
  std::uint64_t stray_bytes() const { return stray_bytes_; }

 private:
  void find_records(std::string_view bytes);

  void* bytes_ = nullptr;
  std::size_t size_ = 0;
  std::vector<SpooledFrame> frames_;
  std::uint64_t stray_bytes_ = 0;
};

}  // namespace tankrig
