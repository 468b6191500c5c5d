#include "apps/tankrig/calibrate_all/live_pictures.hpp"

#include <fmt/format.h>

#include "core/input_error.hpp"
#include "core/thread_priority.hpp"

namespace tankrig::app {
LivePictures::LivePictures(PictureJudge judge, Progress& progress)
    : judge_(std::move(judge)), progress_(progress), thread_([this] { run(); }) {}

LivePictures::~LivePictures() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
  if (!so_far_.empty()) progress_.note(so_far_);
}

void LivePictures::frame(const FrameRecord& record, const cv::Mat& image) {
  const std::optional<int> number = judge_.moment_of(record);
  if (!number) return;
  {
    const std::lock_guard lock(mutex_);
    Moment& moment = coming_[*number];
    moment.emplace(record.camera, RecordedPicture{record, image});
    if (moment.size() < judge_.cameras) return;
    whole_.emplace_back(*number, std::move(moment));
    coming_.erase(*number);
  }
  wake_.notify_one();
}

void LivePictures::judge(int number, const Moment& moment) {
  try {
    if (const auto judged = judge_.judge(number, moment)) {
      if (judged->fault) progress_.note(in_words(*judged));
      for (const JudgedPicture& p : judged->cameras)
        if (p.why_not.empty() && p.pictures == judged->enough)
          progress_.note(p.camera + ": " + that_count(p.pictures, "the " + judged->target));
      show(*judged);
      so_far_ = fmt::format("pictures of the {} that count: {}", judged->target, so_far_in_words(*judged));
    }
  } catch (const InputError& e) {  // the step itself will meet it, and end by it
    progress_.note(fmt::format("picture {} cannot be judged: {}", number + 1, e.what()));
  }
}

void LivePictures::run() {
  set_background("judge");
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ends_ || !whole_.empty(); });
    if (whole_.empty()) return;
    const std::vector<std::pair<int, Moment>> now = std::exchange(whole_, {});
    lock.unlock();
    for (const auto& [number, moment] : now) judge(number, moment);
    lock.lock();
  }
}

}  // namespace tankrig::app
