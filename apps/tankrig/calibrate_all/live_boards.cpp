#include "apps/tankrig/calibrate_all/live_boards.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "apps/tankrig/calibrate/dark_frames.hpp"

namespace tankrig::app {
namespace {

constexpr int kNice = 10;

}  // namespace

LiveBoards::LiveBoards(BoardTarget target, BoardCount so_far, std::size_t cameras, Progress& progress)
    : target_(std::move(target)), cameras_(cameras), progress_(progress), count_(std::move(so_far)), thread_([this] {
        run();
      }) {}

LiveBoards::~LiveBoards() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LiveBoards::frame(const FrameRecord& record, const cv::Mat& image) {
  if (record.phase == Phase::kMove) return;
  {
    const std::lock_guard lock(mutex_);
    Moment& moment = coming_[record.pass];
    moment.emplace(record.camera, image);
    if (moment.size() < cameras_) return;
    whole_.emplace_back(record.pass, std::move(moment));
    coming_.erase(record.pass);
  }
  wake_.notify_one();
}

void LiveBoards::run() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ends_ || !whole_.empty(); });
    if (whole_.empty()) return;
    const std::vector<std::pair<int, Moment>> now = std::exchange(whole_, {});
    lock.unlock();
    for (const auto& [picture, moment] : now) judge(picture, moment);
    lock.lock();
  }
}

void LiveBoards::judge(int picture, const Moment& moment) {
  std::vector<BoardSearch> searches;
  for (std::size_t k = 0; k < cameras_; ++k)
    searches.push_back(find_clear_board(grey_of(moment.at(count_.name(k))), target_));
  const std::vector<std::string> why_not = count_.add(searches);
  std::string line = fmt::format("picture {}: ", picture + 1);
  for (std::size_t k = 0; k < cameras_; ++k)
    line += count_.name(k) + (why_not[k].empty() ? " counts; " : ": " + why_not[k] + "; ");
  progress_.note(line + "so far " + count_.so_far());
}

}  // namespace tankrig::app
