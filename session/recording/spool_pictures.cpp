#include "session/recording/spool_pictures.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>

#include "core/atomic_file.hpp"
#include "core/text_files.hpp"
#include "session/reading/session_folder.hpp"
#include "session/reading/session_tables.hpp"
#include "session/recording/png_file.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBatchBytes = 256 << 20;  // written to the disk together

bool holds(const fs::path& file, std::string_view bytes) {
  std::error_code unknown;
  return fs::is_regular_file(file, unknown) && fs::file_size(file, unknown) == bytes.size() &&
         read_whole_file(file) == bytes;
}

/// The pictures of one segment. True if it holds nothing else, and nobody asked to stop. A picture that cannot be
/// written keeps no other from it.
bool write_segment(const fs::path& session, const SpoolSegment& segment, const PictureOptions& options) {
  std::vector<std::pair<std::string, const cv::Mat*>> pictures;
  for (const SpooledFrame& frame : segment.frames())
    if (auto record = parse_frames_line(frame.line); record && (!options.accept || options.accept(*record)))
      pictures.emplace_back(std::move(record->file), &frame.image);
  std::atomic<bool> done = segment.stray_bytes() == 0 && pictures.size() == segment.frames().size();
  std::mutex mutex;
  std::exception_ptr failure;
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    if (options.stop && options.stop()) {
      done = false;
      return;
    }
    const auto& [name, image] = pictures[i];
    try {
      const fs::path file = place_below(session, name);
      const std::string png = png_of(*image, file);
      if (holds(file, png)) return;  // of a run that was killed
      if (options.set_aside) options.set_aside(name);
      write_whole_file(file, png);
    } catch (const InputError&) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  });
  if (failure) std::rethrow_exception(failure);
  return done;
}

}  // namespace

std::uint64_t most_on_disk(std::uint64_t raw_bytes) {
  return raw_bytes + std::min(raw_bytes, kBatchBytes + kSegmentBytes);
}

bool write_spooled_pictures(const fs::path& session, const PictureOptions& options) {
  const std::vector<fs::path> segments = spool_segments(session);
  std::vector<fs::path> done;
  std::uint64_t batch = 0;
  FileSystemSync disk(session);
  const auto remove_done = [&] {
    if (!done.empty()) disk.sync();
    for (const fs::path& segment : done) fs::remove(segment);
    done.clear(), batch = 0;
  };
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (options.stop && options.stop()) return remove_done(), false;
    if (options.progress) options.progress(static_cast<double>(i) / static_cast<double>(segments.size()));
    batch += fs::file_size(segments[i]);
    if (write_segment(session, SpoolSegment(segments[i]), options)) done.push_back(segments[i]);
    if (batch >= kBatchBytes) remove_done();
  }
  remove_done();
  const bool left = !spool_segments(session).empty();
  if (left && options.stop && options.stop()) return false;
  if (has_spool(session) && !left) fs::remove_all(spool_folder(session));
  if (options.progress) options.progress(1);
  return true;
}

}  // namespace tankrig
