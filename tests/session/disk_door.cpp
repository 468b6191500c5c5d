#include "tests/session/disk_door.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <fstream>
#include <mutex>
#include <thread>

namespace tankrig::testing_support {
namespace {

namespace fs = std::filesystem;
using Fails = DiskDoor::Fails;

std::atomic<bool> watched{false}, shut{false};
std::atomic<int> waiting{0}, error_to_give{0};
std::mutex mutex;
// Never destroyed: a thread that was left behind may come by at the program's end.
auto& root = *new fs::path;
auto& contents = *new std::map<ino_t, std::string>;                // of a file at its last sync
auto& names = *new std::map<fs::path, std::map<fs::path, ino_t>>;  // of a folder's files at its last sync
auto& step_failed = *new std::string;
int steps = 0, step_to_fail = -1, step_error = 0;
Fails step_how = Fails::kNever;

fs::path path_of(int descriptor) {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/fd/" + std::to_string(descriptor), ignored);
}

bool below_root(const fs::path& path) { return path.string().starts_with(root.string()); }

ino_t inode_of(const fs::path& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_ino : 0;
}

void note_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  contents[inode_of(file)] = {std::istreambuf_iterator<char>(in), {}};
}

void note_names(const fs::path& folder) {
  std::map<fs::path, ino_t>& there = names[folder];
  there.clear();
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) there[entry.path()] = inode_of(entry.path());
}

void note(long call, const fs::path& path) {
  std::error_code ignored;
  if (call == SYS_syncfs) {
    std::erase_if(names, [](const auto& folder) { return !fs::exists(folder.first); });
    note_names(root);
    for (const auto& entry : fs::recursive_directory_iterator(root, ignored))
      entry.is_directory() ? note_names(entry.path()) : note_file(entry.path());
  } else {
    fs::is_directory(path, ignored) ? note_names(path) : note_file(path);
  }
}

/// The error of this step, or 0.
int failure_of(const char* call, const fs::path& path) {
  if (!watched) return 0;
  const std::lock_guard lock(mutex);
  if (!below_root(path)) return 0;
  const int step = steps++;
  if (step != step_to_fail && !(step > step_to_fail && step_to_fail >= 0 && step_how == Fails::kFromThenOn)) return 0;
  if (step_failed.empty()) step_failed = std::string(call) + " " + path.filename().string();
  return step_error;
}

int failure_of(const char* call, int descriptor) {
  const int saved = errno;
  const int error = watched ? failure_of(call, path_of(descriptor)) : 0;
  errno = saved;
  return error;
}

int sync(const char* name, long call, int descriptor) {
  const int saved = errno;
  const fs::path path = path_of(descriptor);
  if (watched) {
    ++waiting;
    while (shut) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    --waiting;
    if (const int error = error_to_give) return errno = error, -1;
    if (const int error = failure_of(name, path)) return errno = error, -1;
    const std::lock_guard lock(mutex);
    if (below_root(path)) note(call, path);
  }
  errno = saved;
  return static_cast<int>(::syscall(call, descriptor));
}

}  // namespace

DiskDoor::DiskDoor(const fs::path& folder) {
  const std::lock_guard lock(mutex);
  root = folder;
  contents.clear(), names.clear(), step_failed.clear();
  steps = 0, step_to_fail = -1;
  watched = true;
}
DiskDoor::~DiskDoor() {
  let_go();
  refuse(0);
  watched = false;
}

void DiskDoor::hold() { shut = true; }
void DiskDoor::let_go() { shut = false; }
bool DiskDoor::someone_waits() const { return shut && waiting > 0; }
void DiskDoor::refuse(int error) { error_to_give = error; }

void DiskDoor::fail(int step, int error, Fails how) {
  const std::lock_guard lock(mutex);
  steps = 0, step_to_fail = step, step_error = error, step_how = how;
}

std::string DiskDoor::failed() const {
  const std::lock_guard lock(mutex);
  return step_failed;
}

std::map<std::string, std::string> DiskDoor::on_disk(const fs::path& folder) const {
  const std::lock_guard lock(mutex);
  std::map<std::string, std::string> out;
  for (const auto& [parent, files] : names)
    for (const auto& [file, inode] : files)
      if (const auto found = contents.find(inode);
          found != contents.end() && file.string().starts_with(folder.string() + "/"))
        out[file.lexically_relative(folder).generic_string()] = found->second;
  return out;
}

void leave_on_disk(const DiskDoor& door, const fs::path& session, const fs::path& cut) {
  for (const auto& [name, text] : door.on_disk(session)) {
    fs::create_directories((cut / name).parent_path());
    std::ofstream(cut / name, std::ios::binary) << text;
  }
}

}  // namespace tankrig::testing_support

extern "C" {

using tankrig::testing_support::failure_of;

int fdatasync(int descriptor) { return tankrig::testing_support::sync("fdatasync", SYS_fdatasync, descriptor); }
int fsync(int descriptor) { return tankrig::testing_support::sync("fsync", SYS_fsync, descriptor); }
int syncfs(int descriptor) noexcept { return tankrig::testing_support::sync("syncfs", SYS_syncfs, descriptor); }

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) || (flags & O_TMPFILE) == O_TMPFILE ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  const bool step = (flags & O_ACCMODE) != O_RDONLY || (flags & O_DIRECTORY);
  if (const int error = step ? failure_of("open", path) : 0) return errno = error, -1;
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

ssize_t write(int descriptor, const void* bytes, size_t count) {
  if (const int error = failure_of("write", descriptor)) return errno = error, -1;
  return ::syscall(SYS_write, descriptor, bytes, count);
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
  if (const int error = failure_of("writev", descriptor)) return errno = error, -1;
  return ::syscall(SYS_writev, descriptor, parts, count);
}

int rename(const char* from, const char* to) noexcept {
  if (const int error = failure_of("rename", to)) return errno = error, -1;
  return static_cast<int>(::syscall(SYS_rename, from, to));
}
}
