#include "tests/session/disk_door.hpp"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

namespace tankrig::testing_support {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> watched{false}, shut{false};
std::atomic<int> waiting{0}, error_to_give{0};
std::mutex mutex;
// Never destroyed: a thread that was left behind may come by at the program's end.
auto& bytes = *new std::map<fs::path, std::uint64_t>;  // of a file at its last sync
auto& names = *new std::set<fs::path>;                 // whose folder was synced since they are in it

fs::path path_of(int descriptor) {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/fd/" + std::to_string(descriptor), ignored);
}

void note_file(const fs::path& file) {
  std::error_code ignored;
  const auto size = fs::file_size(file, ignored);
  if (!ignored) bytes[file] = size;
}

void note(long call, const fs::path& path) {
  std::error_code ignored;
  if (call == SYS_syncfs) {
    for (const auto& entry : fs::recursive_directory_iterator(path, ignored)) {
      names.insert(entry.path());
      if (entry.is_regular_file()) note_file(entry.path());
    }
  } else if (fs::is_directory(path, ignored)) {
    for (const auto& entry : fs::directory_iterator(path, ignored)) names.insert(entry.path());
  } else {
    note_file(path);
  }
}

int pass(long call, int descriptor) {
  if (watched) {
    ++waiting;
    while (shut) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    --waiting;
    if (const int error = error_to_give) return errno = error, -1;
    const std::lock_guard lock(mutex);
    note(call, path_of(descriptor));
  }
  return static_cast<int>(::syscall(call, descriptor));
}

}  // namespace

DiskDoor::DiskDoor() {
  bytes.clear();
  names.clear();
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

std::map<std::string, std::uint64_t> DiskDoor::on_disk(const fs::path& folder) const {
  const std::lock_guard lock(mutex);
  std::map<std::string, std::uint64_t> out;
  for (const auto& [file, size] : bytes)
    if (names.contains(file) && file.string().starts_with(folder.string() + "/"))
      out[file.lexically_relative(folder).generic_string()] = size;
  return out;
}

}  // namespace tankrig::testing_support

extern "C" {

int fdatasync(int descriptor) { return tankrig::testing_support::pass(SYS_fdatasync, descriptor); }
int fsync(int descriptor) { return tankrig::testing_support::pass(SYS_fsync, descriptor); }
int syncfs(int descriptor) noexcept { return tankrig::testing_support::pass(SYS_syncfs, descriptor); }
}
