#include "apps/tankrig/bench/scratch_folder.hpp"

#include <cerrno>
#include <cstdlib>

#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// A folder may be closed to its own owner.
void open_folders(const fs::path& folder) {
  std::error_code ignored;  // what stays closed is left, and remove() says so
  fs::permissions(folder, fs::perms::owner_all, fs::perm_options::add, ignored);
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    std::error_code gone;
    if (entry->symlink_status(gone).type() == fs::file_type::directory) open_folders(entry->path());
  }
}

}  // namespace

ScratchFolder::ScratchFolder(const std::string& name) {
  std::string place = (fs::temp_directory_path() / (name + "-XXXXXX")).string();
  if (!::mkdtemp(place.data())) throw CannotWrite(fs::path(place), errno);
  path_ = place;
}

ScratchFolder::~ScratchFolder() { remove(); }

bool ScratchFolder::remove() {
  std::error_code problem;
  fs::remove_all(path_, problem);
  if (!problem) return true;
  open_folders(path_);
  fs::remove_all(path_, problem);
  return !problem;
}

}  // namespace tankrig::app
