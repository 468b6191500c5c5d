// Submissions to the benchmark platform: a queue and its results, in SQLite; their files lie in a folder each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct sqlite3;

namespace tankrig {

struct Submission {
  std::string id;       ///< random: of its permanent link and its folder
  std::string dataset;  ///< its name
  std::string file;     ///< "cloud.ply", "cloud.pcd" or "algorithm.tar.gz"
  std::string name;     ///< as its sender calls it: any text
  std::string uses;     ///< "laser" or "stereo"
  std::string user, address;
  std::int64_t received_s = 0;  ///< since 1970
  std::uint64_t bytes = 0;
  std::string state = "queued";  ///< "queued", "running", "done", "failed"
  std::string message = {};      ///< why it failed
  std::string figures = {};      ///< JSON, of one that is done
  double rank = 0;               ///< the higher, the better
};

/// What somebody has sent lately.
struct Usage {
  int uploads = 0;  ///< within the time asked for
  std::uint64_t bytes = 0;
  int waiting = 0;            ///< not scored yet, whenever they came
  std::int64_t oldest_s = 0;  ///< when the oldest of the uploads came
};

/// A change outlives this process when the call returns, and a power cut when its file system has been synced since:
/// the server, which has one thread, does not wait for the disk.
/// Threads: one.
/// Errors: InputError naming the database, of every member.
class Store {
 public:
  /// Opens or makes `folder`. What ran when the last server ended is queued again, or has failed if that was its second
  /// time. Folders of uploads that were never entered are removed.
  explicit Store(const std::filesystem::path& folder);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  /// The folder of a submission's files.
  std::filesystem::path place_of(const std::string& id) const { return folder_ / "submissions" / id; }
  static std::string new_id();

  void add(const Submission& submission) { add(std::vector{submission}); }
  void add(const std::vector<Submission>& submissions);  ///< all of them or none
  /// Whether it was still queued: then it has never been.
  bool withdraw(const std::string& id);
  /// The oldest that is queued, running from now on.
  std::optional<Submission> take();
  void finish(const Submission& submission);  ///< by its state, message, figures and rank
  void put_back();                            ///< what runs; it does not count as a try

  std::optional<Submission> find(const std::string& id) const;
  /// Those that are done, the best first.
  std::vector<Submission> best(const std::string& dataset, int most) const;
  /// The newest, in whatever state.
  std::vector<Submission> newest(const std::string& dataset, int most) const;
  int waiting() const;
  /// How many are taken before this one.
  int before(const std::string& id) const;
  enum class Whose { kUser, kAddress };
  Usage usage(Whose whose, const std::string& name, std::int64_t since_s) const;

 private:
  class Statement;
  class Transaction;
  void insert(const Submission& submission);
  void remove_strays() const;
  std::vector<Submission> list(Statement& statement) const;

  const std::filesystem::path folder_;
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> database_;
};

}  // namespace tankrig
