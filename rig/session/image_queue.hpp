// Frames on their way to disk: a bounded queue and the threads that compress and write PNG files.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>
#include <vector>

namespace tankrig {

/// Threads: push and finish from one; writes in its own.
/// Errors: the first failure of a writing thread (InputError naming the file) is thrown by the next push or finish.
class ImageQueue {
 public:
  ImageQueue(int threads, int capacity);
  ~ImageQueue();
  ImageQueue(const ImageQueue&) = delete;
  ImageQueue& operator=(const ImageQueue&) = delete;

  /// Hands over `image` (shared, not copied: nobody writes to it any more). With a full queue: waits if `wait`,
  /// else returns false and forgets the image.
  bool push(const std::filesystem::path& file, const cv::Mat& image, bool wait);

  /// Returns when everything is written. No push after it.
  void finish();

 private:
  struct Job {
    std::filesystem::path file;
    cv::Mat image;
  };
  void work();
  void stop();
  void rethrow();

  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable room_, work_;
  std::deque<Job> jobs_;
  std::exception_ptr failure_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

/// Compresses `image` for speed (Huffman codes only: noise does not repeat) and writes it whole or not at all.
/// Errors: InputError naming the file.
void write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace tankrig
