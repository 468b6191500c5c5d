// Files written whole or not at all, and what a failed sync means.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/input_error.hpp"

namespace tankrig {

/// The suffix of every unfinished file: never sealed, never part of a session.
inline constexpr const char* kUnfinished = ".tmp";

/// The system refuses the write.
class CannotWrite : public InputError {
 public:
  CannotWrite(const std::filesystem::path& file, int error);
  bool disk_full() const noexcept;

 protected:
  CannotWrite(const std::string& message, int error) : InputError(message), error_(error) {}

 private:
  int error_;
};

/// A sync failed: what was written may not be on the disk, though it reads back. The file it was to replace is kept,
/// and nothing may build on the new one. A retry proves nothing, because the system reports a loss only once.
class NotOnDisk : public CannotWrite {
 public:
  NotOnDisk(const std::filesystem::path& file, int error);
  NotOnDisk(const std::filesystem::path& file, const std::string& message);
};

/// Replaces `file` through a temporary file beside it: a reader sees the old or the new one, never a part. On return
/// the new file and its name are on the disk.
/// Errors: CannotWrite; the temporary file is removed.
void write_file_durably(const std::filesystem::path& file, std::string_view bytes);

/// The same without waiting for the disk: for files that a FileSystemSync or a seal covers, or that may be lost in a
/// power cut.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// A new file beside `file`, under an unused name. It is removed unless it is put in place.
class UnfinishedFile {
 public:
  /// Errors: CannotWrite naming `file`.
  explicit UnfinishedFile(const std::filesystem::path& file);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }
  /// Gives it its name. Durable: file and name are on the disk on return.
  /// Errors: CannotWrite.
  void put_in_place();
  void put_in_place_durably();

 private:
  const std::filesystem::path file_;
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool in_place_ = false;
};

/// The same for a folder beside `target`. It is removed with its contents unless it is put in place.
class UnfinishedFolder {
 public:
  /// Makes missing parent folders.
  /// Errors: InputError naming `target`.
  explicit UnfinishedFolder(const std::filesystem::path& target);
  ~UnfinishedFolder();
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Absolute, without a trailing slash.
  const std::filesystem::path& target() const { return target_; }
  /// Its name is on the disk on return. The caller syncs its contents.
  /// Errors: InputError if something else has the name by now; NotOnDisk.
  void put_in_place();

 private:
  std::filesystem::path target_, path_;
};

/// Takes the written bytes off `bytes`.
/// Errors: CannotWrite naming `file`.
void write_all(const std::filesystem::path& file, int descriptor, std::string_view& bytes);

/// Brings an open file, including its length, to the disk.
/// Errors: NotOnDisk naming `file`.
void sync_file(const std::filesystem::path& file, int descriptor);

/// Brings the names in `folder` to the disk.
/// Errors: NotOnDisk.
void sync_folder(const std::filesystem::path& folder);

/// Brings everything written to one file system since its construction to the disk in one go.
/// Linux reports failed writes since 5.8, and only those since this object opened the file system or that nobody has
/// been told of.
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
