// Files written whole or not at all, and what a sync that fails means.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/input_error.hpp"

namespace tankrig {

/// Ends the name of everything that is not finished yet: never sealed, never part of a session.
inline constexpr const char* kUnfinished = ".tmp";

/// The system refuses to write.
class CannotWrite : public InputError {
 public:
  CannotWrite(const std::filesystem::path& file, int error);
  bool disk_full() const noexcept;

 protected:
  CannotWrite(const std::string& message, int error) : InputError(message), error_(error) {}

 private:
  int error_;
};

/// A sync failed: what was written may not be on the disk, though it reads back. What it was to replace is kept, and
/// nothing may be built on it; asking again proves nothing, because the system tells of a loss only once.
class NotOnDisk : public CannotWrite {
 public:
  NotOnDisk(const std::filesystem::path& file, int error);
  NotOnDisk(const std::filesystem::path& file, const std::string& message);
};

/// Replaces `file` by way of a temporary file beside it: a reader sees the old or the new one, never a part. The new
/// one and its name are on the disk itself when this returns. Errors: CannotWrite; the temporary file is removed.
void write_file_durably(const std::filesystem::path& file, std::string_view bytes);

/// The same without waiting for the disk: for what a FileSystemSync or a seal covers, or nobody misses after a power
/// cut.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// Gives a file that others have written whole its name, both on the disk when this returns.  Errors: CannotWrite.
void put_in_place_durably(const std::filesystem::path& unfinished, const std::filesystem::path& file);

/// Takes from `bytes` what is written.  Errors: CannotWrite naming `file`.
void write_all(const std::filesystem::path& file, int descriptor, std::string_view& bytes);

/// What was written to an open file, its length included, is on the disk.  Errors: NotOnDisk naming `file`.
void sync_file(const std::filesystem::path& file, int descriptor);

/// The names in `folder` are on the disk.  Errors: NotOnDisk.
void sync_folder(const std::filesystem::path& folder);

/// Everything written to one file system from its construction on, brought to the disk in one go.
/// Linux tells of writes that failed since 5.8, and only of those since the file system was opened here, or that nobody
/// was told of yet.
class FileSystemSync {
 public:
  /// `folder` is on that file system.  Errors: NotOnDisk.
  explicit FileSystemSync(std::filesystem::path folder);
  ~FileSystemSync();
  FileSystemSync(const FileSystemSync&) = delete;
  FileSystemSync& operator=(const FileSystemSync&) = delete;

  /// Errors: NotOnDisk.
  void sync();

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
};

}  // namespace tankrig
