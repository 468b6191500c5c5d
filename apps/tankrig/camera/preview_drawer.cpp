#include "apps/tankrig/camera/preview_drawer.hpp"

#include <utility>

namespace tankrig::app {

PreviewDrawer::PreviewDrawer(PreviewOutput& output, bool beside) : output_(output) {
  if (beside) thread_ = std::thread([this] { run(); });
}

PreviewDrawer::~PreviewDrawer() {
  try {
    end();
  } catch (...) {  // told by whoever ended it in time
  }
}

void PreviewDrawer::add_background(const cv::Mat& image) {
  hand({.kind = Item::Kind::kBackground, .image = thread_.joinable() ? image.clone() : image});
}

void PreviewDrawer::add(const cv::Mat& image, Stamp stamp, bool lit, const CameraCounters& counters) {
  const bool drawn = !thread_.joinable() || !busy();
  hand({.kind = drawn ? Item::Kind::kFrame : Item::Kind::kCount,
        .image = !drawn               ? cv::Mat()
                 : thread_.joinable() ? image.clone()
                                      : image,
        .stamp = stamp,
        .lit = lit,
        .counters = counters});
}

void PreviewDrawer::finish_line() { hand({.kind = Item::Kind::kFinishLine}); }

void PreviewDrawer::end() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

bool PreviewDrawer::busy() {
  const std::lock_guard lock(mutex_);
  return frames_ > 1;
}

void PreviewDrawer::hand(Item item) {
  if (!thread_.joinable()) {
    take(item);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    if (item.kind == Item::Kind::kFrame) ++frames_;
    items_.push_back(std::move(item));
  }
  changed_.notify_all();
}

void PreviewDrawer::take(const Item& item) {
  switch (item.kind) {
    case Item::Kind::kBackground:
      output_.add_background(item.image);
      break;
    case Item::Kind::kFrame:
      output_.add(item.image, item.stamp, item.lit, item.counters);
      break;
    case Item::Kind::kCount:
      output_.count(item.stamp);
      break;
    case Item::Kind::kFinishLine:
      output_.finish_line();
      break;
  }
}

void PreviewDrawer::run() noexcept {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ends_ || !items_.empty(); });
    if (items_.empty()) return;
    const Item item = std::move(items_.front());
    items_.pop_front();
    lock.unlock();
    std::exception_ptr failure;
    try {
      take(item);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (item.kind == Item::Kind::kFrame) --frames_;
    if (failure) failure_ = failure;
  }
}

}  // namespace tankrig::app
