#include "session/reading/session_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// A folder held open, while another one is looked for below it.
class HeldFolder {
 public:
  explicit HeldFolder(const fs::path& path) : descriptor_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {}
  ~HeldFolder() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  HeldFolder(const HeldFolder&) = delete;
  HeldFolder& operator=(const HeldFolder&) = delete;

  /// False, with errno, if `name` is no folder in this one, or a link to one.
  bool enter(const fs::path& name) {
    const int inner = ::openat(descriptor_, name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    const int error = errno;
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = inner;
    errno = error;
    return inner >= 0;
  }
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

void expect_inside(const fs::path& session, const fs::path& name) {
  if (!stays_inside(name)) throw InputError(session, "'" + name.string() + "' leads outside, expected a name in it");
}

}  // namespace

void refuse_links(const fs::path& session) {
  for (const auto& entry : fs::recursive_directory_iterator(session))
    if (entry.is_symlink())
      throw InputError(entry.path(),
                       "is a symbolic link, expected a session that is all in its own folder: put there "
                       "what the link names, or remove the link");
}

std::string read_below(const fs::path& session, const fs::path& name, std::uint64_t most, const std::string& expected) {
  expect_inside(session, name);
  HeldFolder folder(session);
  bool there = folder.descriptor() >= 0;
  for (const fs::path& part : name.parent_path()) there = there && folder.enter(part);
  const int file =
      there ? ::openat(folder.descriptor(), name.filename().c_str(), kReadWithoutWaiting | O_NOFOLLOW) : -1;
  return read_regular_file(file, session / name, most, expected);
}

fs::path place_below(const fs::path& session, const fs::path& name) {
  expect_inside(session, name);
  HeldFolder folder(session);
  fs::path reached = session;
  for (const fs::path& part : name.parent_path()) {
    reached /= part;
    const bool made = ::mkdirat(folder.descriptor(), part.c_str(), 0777) == 0 || errno == EEXIST;
    if (!made || !folder.enter(part)) throw CannotWrite(reached, errno);
  }
  return session / name;
}

}  // namespace tankrig
