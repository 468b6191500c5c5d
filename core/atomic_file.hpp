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
/// one and its name are on the disk itself when this returns.
/// Errors: CannotWrite; the temporary file is removed.
void write_file_durably(const std::filesystem::path& file, std::string_view bytes);

/// The same without waiting for the disk: for what a FileSystemSync or a seal covers, or nobody misses after a power
/// cut.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// A new file beside `file`, under a name that nothing had: gone again unless it is put in place.
class UnfinishedFile {
 public:
  /// Errors: CannotWrite naming `file`.
  explicit UnfinishedFile(const std::filesystem::path& file);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }
  /// Gives it its name. Durably: file and name are on the disk when this returns.
  /// Errors: CannotWrite.
  void put_in_place();
  void put_in_place_durably();

 private:
  const std::filesystem::path file_;
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool in_place_ = false;
};

/// The same of a folder: made beside `target`, under a name that nothing had, and gone again, with all that is in it,
/// unless it is put in place.
class UnfinishedFolder {
 public:
  /// Makes the folders above it where they are missing.
  /// Errors: InputError naming `target`.
  explicit UnfinishedFolder(const std::filesystem::path& target);
  ~UnfinishedFolder();
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Absolute, without a slash at its end.
  const std::filesystem::path& target() const { return target_; }
  /// Its name is on the disk when this returns; what is in it is the caller's to sync.
  /// Errors: InputError if something else has the name by now; NotOnDisk.
  void put_in_place();

 private:
  std::filesystem::path target_, path_;
};

/// Takes from `bytes` what is written.
/// Errors: CannotWrite naming `file`.
void write_all(const std::filesystem::path& file, int descriptor, std::string_view& bytes);

/// What was written to an open file, its length included, is on the disk.
/// Errors: NotOnDisk naming `file`.
void sync_file(const std::filesystem::path& file, int descriptor);

/// The names in `folder` are on the disk.
/// Errors: NotOnDisk.
void sync_folder(const std::filesystem::path& folder);

/// Everything written to one file system from its construction on, brought to the disk in one go.
/// Linux tells of writes that failed since 5.8, and only of those since the file system was opened here, or that nobody
/// was told of yet.
class FileSystemSync {
 public:
  /// `folder` is on that file system.
  /// Errors: NotOnDisk.
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
