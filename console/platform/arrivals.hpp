// Uploads reach the disk in a thread of their own, all that wait at once: the server goes on serving.
#pragma once

#include <boost/asio/io_context.hpp>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "console/platform/store.hpp"
#include "core/atomic_file.hpp"

namespace tankrig {

/// An upload on its way, and its file, which goes with it if it is never entered.
struct Arriving {
  Arriving(Submission s, const std::filesystem::path& place) : submission(std::move(s)), file(place) {}
  Submission submission;
  UnfinishedFile file;
  bool entered = false;
};

/// One sync takes as long for twenty uploads as for one; those that come while it lasts share the next. An upload is
/// told after two: its file is on the disk before its row is written, and the row before its sender hears of it.
class Arrivals {
 public:
  struct Brought {
    std::shared_ptr<Arriving> upload;
    std::string why_not;  ///< empty: it is on the disk
    std::function<void(const Brought&)> done;
  };
  using Batch = std::vector<Brought>;

  /// `place_of`: the folder of a submission's files, which is made. `brought` is called in `io`'s thread.
  /// Errors: InputError if `store` cannot be opened.
  Arrivals(boost::asio::io_context& io, const std::filesystem::path& store,
           std::function<std::filesystem::path(const std::string& id)> place_of, std::function<void(Batch)> brought);
  /// Waits for the sync that runs; of what still waits nothing is told.
  ~Arrivals();
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  /// The whole upload is in its file.
  void bring(std::shared_ptr<Arriving> upload, std::function<void(const Brought&)> done);

  /// Their rows are written: once these are on the disk, each is told.
  void confirm(Batch batch);

 private:
  void run();
  void put_in_place(Batch& batch);

  boost::asio::io_context& io_;
  FileSystemSync disk_;
  const std::function<std::filesystem::path(const std::string&)> place_of_;
  const std::function<void(Batch)> brought_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Batch waiting_, entered_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace tankrig
