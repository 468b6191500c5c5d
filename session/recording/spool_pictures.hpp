// The spool turned into pictures after the run, on every core.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "session/reading/session.hpp"

namespace tankrig {

/// Options of the conversion: a report of its progress in [0, 1], and a way to end it early.
/// Threads: several ask `stop` and call `set_aside`, once per file if `accept` refuses a second frame of its name.
struct PictureOptions {
  std::function<void(double)> progress = {};
  std::function<bool()> stop = {};
  /// For frames that others may have written: whether this one becomes a picture, and what happens to the session's
  /// file that its picture would replace.
  std::function<bool(const FrameRecord&)> accept = {};
  std::function<void(const std::string& file)> set_aside = {};
};

/// The most disk space that frames of so many bytes take while they become pictures: raw, and one batch twice.
std::uint64_t most_on_disk(std::uint64_t raw_bytes);

/// Writes the picture of every whole frame to the file its line names. A segment is removed once its pictures are on
/// the disk, the spool once it is empty. A segment with anything but whole, accepted frames stays. May be killed
/// anywhere and run again. True unless stopped early.
/// Errors: CannotWrite naming the file; NotOnDisk if the pictures may not be on the disk: their segments stay.
bool write_spooled_pictures(const std::filesystem::path& session, const PictureOptions& options = {});

}  // namespace tankrig
