#include "rig/session/image_queue.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "rig/session/text_files.hpp"

namespace tankrig {

void write_png(const std::filesystem::path& file, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY});
  } catch (const cv::Exception&) {
  }
  if (!encoded) throw InputError(file, "cannot be encoded, expected an image of 8 bits and 1 or 3 channels");
  write_whole_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

ImageQueue::ImageQueue(int threads, int capacity) : capacity_(static_cast<std::size_t>(std::max(capacity, 1))) {
  for (int i = 0; i < std::max(threads, 1); ++i) threads_.emplace_back([this] { work(); });
}

ImageQueue::~ImageQueue() { stop(); }

bool ImageQueue::push(const std::filesystem::path& file, const cv::Mat& image, bool wait) {
  std::unique_lock lock(mutex_);
  if (wait) room_.wait(lock, [this] { return jobs_.size() < capacity_ || failure_; });
  rethrow();
  if (jobs_.size() >= capacity_) return false;
  jobs_.push_back({file, image});
  work_.notify_one();
  return true;
}

void ImageQueue::finish() {
  stop();
  const std::lock_guard lock(mutex_);
  rethrow();
}

void ImageQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_.notify_all();
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
}

void ImageQueue::rethrow() {
  if (failure_) std::rethrow_exception(failure_);
}

void ImageQueue::work() {
  for (;;) {
    std::unique_lock lock(mutex_);
    work_.wait(lock, [this] { return !jobs_.empty() || closing_; });
    if (jobs_.empty()) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    room_.notify_one();
    try {
      write_png(job.file, job.image);
    } catch (...) {
      lock.lock();
      if (!failure_) failure_ = std::current_exception();
      lock.unlock();
      room_.notify_all();
    }
  }
}

}  // namespace tankrig
