#include "core/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// 0, or what the system says. A disk that knows no sync says EINVAL; everything else is a loss.
template <class Sync>
int error_of(Sync sync, int descriptor) {
  while (sync(descriptor) != 0) {
    if (errno == EINVAL) return 0;
    if (errno != EINTR) return errno;
  }
  return 0;
}

int open_folder(const fs::path& folder) {
  const char* name = folder.empty() ? "." : folder.c_str();
  const int descriptor = ::open(name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) throw NotOnDisk(name, errno);
  return descriptor;
}

}  // namespace

CannotWrite::CannotWrite(const fs::path& file, int error)
    : InputError(file, std::string("cannot be written: ") + std::strerror(error)), error_(error) {}

bool CannotWrite::disk_full() const noexcept { return error_ == ENOSPC || error_ == EDQUOT; }

NotOnDisk::NotOnDisk(const fs::path& file, int error)
    : CannotWrite(file.string() + ": cannot be brought to the disk: " + std::strerror(error), error) {}

NotOnDisk::NotOnDisk(const fs::path& file, const std::string& message)
    : CannotWrite(file.string() + ": " + message, EIO) {}

void write_all(const fs::path& file, int descriptor, std::string_view& bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw CannotWrite(file, errno);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void write_whole_file(const fs::path& file, std::string_view bytes) {
  UnfinishedFile fresh(file);
  write_all(file, fresh.descriptor(), bytes);
  fresh.put_in_place();
}

void write_file_durably(const fs::path& file, std::string_view bytes) {
  UnfinishedFile fresh(file);
  write_all(file, fresh.descriptor(), bytes);
  fresh.put_in_place_durably();
}

UnfinishedFile::UnfinishedFile(const fs::path& file) : file_(file), path_(file.string() + kUnfinished) {
  for (int n = 1; descriptor_ < 0; ++n) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) break;
    if (errno != EEXIST) throw CannotWrite(file_, errno);
    path_ = fmt::format("{}.{}{}", file.string(), n, kUnfinished);
  }
}

UnfinishedFile::~UnfinishedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!in_place_) ::unlink(path_.c_str());
}

void UnfinishedFile::put_in_place() {
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  in_place_ = closed == 0 && ::rename(path_.c_str(), file_.c_str()) == 0;
  if (!in_place_) throw CannotWrite(file_, errno);
}

void UnfinishedFile::put_in_place_durably() {
  sync_file(file_, descriptor_);
  put_in_place();
  sync_folder(file_.parent_path());
}

UnfinishedFolder::UnfinishedFolder(const fs::path& target) : target_(fs::absolute(target).lexically_normal()) {
  if (!target_.has_filename()) target_ = target_.parent_path();
  std::error_code failed;
  fs::create_directories(target_.parent_path(), failed);
  for (int n = 1; path_.empty(); ++n) {
    const fs::path folder =
        target_.parent_path() / fmt::format(".{}.{}{}", target_.filename().string(), n, kUnfinished);
    if (fs::create_directory(folder, failed))
      path_ = folder;
    else if (failed && failed != std::errc::file_exists)
      throw InputError(target_, "cannot be created: " + failed.message());
  }
}

UnfinishedFolder::~UnfinishedFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

void UnfinishedFolder::put_in_place() {
  if (::rename(path_.c_str(), target_.c_str()) != 0)
    throw InputError(target_, std::string("cannot be created: ") + std::strerror(errno));
  path_ = target_;  // gone again if its name does not get there
  sync_folder(target_.parent_path());
  path_.clear();
}

void sync_file(const fs::path& file, int descriptor) {
  if (const int error = error_of(::fdatasync, descriptor)) throw NotOnDisk(file, error);
}

void sync_folder(const fs::path& folder) {
  const int descriptor = open_folder(folder), error = error_of(::fsync, descriptor);
  ::close(descriptor);
  if (error) throw NotOnDisk(folder, error);
}

FileSystemSync::FileSystemSync(fs::path folder) : folder_(std::move(folder)), descriptor_(open_folder(folder_)) {}

FileSystemSync::~FileSystemSync() { ::close(descriptor_); }

void FileSystemSync::sync() {
  if (const int error = error_of(::syncfs, descriptor_)) throw NotOnDisk(folder_, error);
}

}  // namespace tankrig
