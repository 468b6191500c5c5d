// Which frames have a whole picture, and which pictures have a frame.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/regular_file.hpp"
#include "session/checking/examination.hpp"
#include "session/reading/picture_file.hpp"
#include "session/recording/png_file.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

bool has_check_sums(const fs::path& picture) { return picture.extension() == ".png"; }

bool is_whole_picture(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  try {
    const std::string bytes = read_regular_file(file, kMostPictureBytes, "an image");
    if (has_check_sums(file)) return is_whole_png(bytes);
    decode_picture(bytes, file, nullptr, cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

void tell_lost_frames(Examination& so_far, const std::string& camera, const std::vector<const FrameRecord*>& frames) {
  constexpr std::size_t kNamed = 8;
  std::vector<int> indices;
  for (const FrameRecord* frame : frames) {
    so_far.told.insert(frame->file);
    if (indices.size() < kNamed) indices.push_back(frame->index);
  }
  const auto [first, last] = std::minmax_element(frames.begin(), frames.end(),
                                                 [](const auto* a, const auto* b) { return a->stamp < b->stamp; });
  so_far.losses.push_back(fmt::format("camera {}: {} without a whole picture, {}: {}{}", camera,
                                      plural(frames.size(), "frame"), so_far.span_text((*first)->stamp, (*last)->stamp),
                                      fmt::join(indices, ", "), frames.size() > kNamed ? ", ..." : ""));
}

void leave_out(Examination& so_far, const std::vector<char>& whole) {
  std::size_t line = 0;
  std::vector<FrameRecord> kept;
  const std::string& old = so_far.frames.text;
  std::size_t begin = old.find('\n') + 1;
  std::string text = old.substr(0, begin);
  for (; line < whole.size(); ++line) {
    const std::size_t end = old.find('\n', begin) + 1;
    if (whole[line]) text += old.substr(begin, end - begin), kept.push_back(so_far.frames.records[line]);
    begin = end;
  }
  so_far.frames.text = std::move(text);
  so_far.frames.records = std::move(kept);
  so_far.frames.damaged = true;
}

void keep_frames_with_pictures(Examination& so_far) {
  const std::vector<FrameRecord>& all = so_far.frames.records;
  so_far.frame_lines = all.size();
  std::vector<char> whole(all.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    const fs::path file = so_far.session / all[i].file;
    const bool unlike_seal = so_far.unlike_seal.contains(all[i].file);
    const bool as_sealed = so_far.seal_read && !unlike_seal && fs::exists(file);
    // A seal with a wrong sum does not condemn a PNG: that has sums of its own.
    const bool whole_alone = (!unlike_seal || has_check_sums(file)) && is_whole_picture(file);
    whole[i] = so_far.in_spool.contains(all[i].file) || as_sealed || whole_alone;
  });
  std::map<std::string, std::vector<const FrameRecord*>> lost;
  std::error_code ignored;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (whole[i]) continue;
    lost[all[i].camera].push_back(&all[i]);
    if (fs::exists(so_far.session / all[i].file, ignored)) so_far.set_aside.insert(all[i].file);
  }
  for (const auto& [camera, frames] : lost) tell_lost_frames(so_far, camera, frames);
  if (!lost.empty()) leave_out(so_far, whole);
}

/// Pictures of no line, and files that were never finished.
void set_strays_aside(Examination& so_far) {
  std::set<std::string> known;
  for (const FrameRecord& frame : so_far.frames.records) known.insert(frame.file);
  std::size_t pictures = 0;
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(so_far.session / "frames", none)) {
    const std::string file = entry.path().lexically_relative(so_far.session).generic_string();
    if (!entry.is_regular_file() || known.contains(file) || so_far.set_aside.contains(file)) continue;
    so_far.set_aside.insert(file);
    so_far.told.insert(file);
    if (entry.path().extension() != kUnfinished) ++pictures;
  }
  if (pictures > 0) so_far.losses.push_back("frames: " + plural(pictures, "picture") + " of no line in frames.csv");
}

}  // namespace

void examine_pictures(Examination& so_far) {
  keep_frames_with_pictures(so_far);
  set_strays_aside(so_far);
}

}  // namespace tankrig
