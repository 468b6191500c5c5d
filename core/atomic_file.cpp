#include "core/atomic_file.hpp"

#include <fcntl.h>
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

/// A new file that is gone again unless it is put in place.
class Unfinished {
 public:
  explicit Unfinished(const fs::path& file) : file_(file), temporary_(file.string() + kUnfinished) {
    ::unlink(temporary_.c_str());  // of a run that was killed
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0) throw CannotWrite(file_, errno);
  }
  ~Unfinished() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!in_place_) ::unlink(temporary_.c_str());
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  int descriptor() const { return descriptor_; }
  void put_in_place() {
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    in_place_ = closed == 0 && ::rename(temporary_.c_str(), file_.c_str()) == 0;
    if (!in_place_) throw CannotWrite(file_, errno);
  }

 private:
  const fs::path& file_;
  const fs::path temporary_;
  int descriptor_ = -1;
  bool in_place_ = false;
};

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
  Unfinished fresh(file);
  write_all(file, fresh.descriptor(), bytes);
  fresh.put_in_place();
}

void write_file_durably(const fs::path& file, std::string_view bytes) {
  {
    Unfinished fresh(file);
    write_all(file, fresh.descriptor(), bytes);
    sync_file(file, fresh.descriptor());
    fresh.put_in_place();
  }
  sync_folder(file.parent_path());
}

void put_in_place_durably(const fs::path& unfinished, const fs::path& file) {
  const int descriptor = ::open(unfinished.c_str(), O_RDONLY | O_CLOEXEC);
  const int error = descriptor < 0 ? errno : error_of(::fdatasync, descriptor);
  if (descriptor >= 0) ::close(descriptor);
  if (error) throw NotOnDisk(file, error);
  if (::rename(unfinished.c_str(), file.c_str()) != 0) throw CannotWrite(file, errno);
  sync_folder(file.parent_path());
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
