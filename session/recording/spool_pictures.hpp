// The spool turned into pictures, after the run, with every core.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "session/reading/session.hpp"

namespace tankrig {

/// What a caller may want of the conversion: news of its progress in [0, 1], and a way to end it early, which is asked
/// by several threads; so is `set_aside`, once for a file if `accept` refuses a second frame of its name.
struct PictureOptions {
  std::function<void(double)> progress = {};
  std::function<bool()> stop = {};
  /// Of frames that others may have written: whether this one becomes a picture, and what becomes of a file of the
  /// session that its picture is about to replace.
  std::function<bool(const FrameRecord&)> accept = {};
  std::function<void(const std::string& file)> set_aside = {};
};

/// What frames of so many bytes take on the disk at most while they become pictures: raw, and a batch of them twice.
std::uint64_t most_on_disk(std::uint64_t raw_bytes);

/// Writes the picture of every whole frame of the spool to the file its line names. A segment is removed once its
/// pictures are on the disk, and the spool when it is empty; one that holds anything but whole, accepted frames stays.
/// May be killed anywhere and run again. True unless stopped early.
/// Errors: CannotWrite naming the file; NotOnDisk if the pictures may not be on the disk, and their segments stay.
bool write_spooled_pictures(const std::filesystem::path& session, const PictureOptions& options = {});

}  // namespace tankrig
