// A session as a ZIP archive that is made while it is read: nothing of it is kept, in memory or on the disk.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

/// The regular files of a session, below a folder of its name; what is unfinished is left out. They are stored, not
/// compressed: pictures and clouds hardly shrink, and so the archive's size is known before its first byte. With ZIP64
/// where a file, an offset or the number of files needs it.
/// Threads: one.
class SessionZip {
 public:
  /// Looks at all names and sizes, and reads nothing.
  /// Errors: InputError if it is no session, is being recorded, has changed within the last 20 ms, so that another change
  /// could bear the same time, or holds a link, a device, or a name that another system would read otherwise.
  explicit SessionZip(const std::filesystem::path& session);
  ~SessionZip();
  SessionZip(const SessionZip&) = delete;
  SessionZip& operator=(const SessionZip&) = delete;

  std::uint64_t bytes() const noexcept { return bytes_; }
  /// The next piece, of about 64 KiB; empty: that was all.
  /// Errors: InputError if a file or a folder is not any more as it was found: then what came so far is no archive.
  std::string next();

 private:
  /// What tells a file from what it was.
  struct Seen {
    dev_t device = 0;
    ino_t inode = 0;
    std::int64_t size = 0, changed_s = 0, changed_ns = 0, written_s = 0, written_ns = 0;
    bool operator==(const Seen&) const = default;
  };
  struct File {
    std::string name;  ///< below the session
    Seen seen;
    std::uint64_t offset = 0;  ///< of its header in the archive
    std::uint32_t crc = 0;
  };

  static Seen seen(const struct stat& status);
  void look(const std::filesystem::path& folder);
  void expect_old() const;
  void lay_out();
  void step(std::string& piece);
  void open(const File& file);
  void read(File& file, std::string& piece);
  void expect_same(const std::string& name, const Seen& before) const;
  void end(std::string& piece) const;

  const std::filesystem::path session_;
  const std::string prefix_;  ///< "NAME/"
  std::vector<File> files_;
  std::vector<std::pair<std::string, Seen>> folders_;
  std::uint64_t central_ = 0, central_bytes_ = 0, bytes_ = 0;  ///< where the directory begins; its length; all
  std::size_t sent_ = 0, listed_ = 0;                          ///< files; their entries in the directory
  int descriptor_ = -1;                                        ///< of the file that is being sent
  std::uint64_t left_ = 0;                                     ///< bytes of it
  bool ended_ = false;
};

}  // namespace tankrig
