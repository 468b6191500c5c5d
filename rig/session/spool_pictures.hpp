// The spool turned into pictures, after the run, with every core.
#pragma once

#include <filesystem>
#include <functional>

namespace tankrig {

/// What a caller may want of the conversion: news of its progress in [0, 1], and a way to end it early, which is asked
/// by several threads.
struct PictureOptions {
  std::function<void(double)> progress = {};
  std::function<bool()> stop = {};
};

/// Writes the picture of every whole frame of the spool to the file its line names. A segment is removed once its
/// pictures are on the disk, and the spool when it is empty; one that holds anything but whole frames is kept. May be
/// killed anywhere and run again. True unless stopped early. Errors: InputError naming the file that cannot be written.
bool write_spooled_pictures(const std::filesystem::path& session, const PictureOptions& options = {});

}  // namespace tankrig
