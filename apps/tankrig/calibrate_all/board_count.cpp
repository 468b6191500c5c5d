#include "apps/tankrig/calibrate_all/board_count.hpp"

#include <fmt/format.h>

#include "apps/tankrig/calibrate_all/judged_pictures.hpp"

namespace tankrig::app {

BoardCount::BoardCount(const std::vector<const RigCamera*>& cameras) : shared_(cameras.size()) {
  for (const RigCamera* camera : cameras) {
    names_.push_back(camera->name);
    cameras_.emplace_back(camera->model.width, camera->model.height);
  }
}

std::vector<std::string> BoardCount::add(const std::vector<BoardSearch>& moment) {
  std::vector<std::string> why_not;
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    why_not.push_back(moment[k].board ? cameras_[k].add(*moment[k].board) : moment[k].refused);
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    if (why_not.front().empty() && why_not[k].empty()) ++shared_[k];
  return why_not;
}

std::size_t BoardCount::pictures() const {
  std::size_t sum = 0;
  for (const CountedPictures& camera : cameras_) sum += camera.count();
  return sum;
}

std::string BoardCount::missing() const {
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    if (cameras_[k].count() < kEnough)
      return fmt::format("{}, expected {}: hold it before this camera",
                         that_count(cameras_[k].count(), "the board by camera " + names_[k]), kEnough);
    if (shared_[k] < kEnoughShared)
      return fmt::format("{} for {} and {} at once, expected {}: hold it where both see it",
                         that_count(shared_[k], "the board"), names_.front(), names_[k], kEnoughShared);
  }
  return {};
}

std::string BoardCount::so_far() const {
  std::string counts, covered;
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    counts += fmt::format("{}{} {}", k == 0 ? "" : ", ", names_[k], cameras_[k].count());
    covered += fmt::format("{}{:.0f}", k == 0 ? "" : ", ", 100 * cameras_[k].covered());
  }
  return fmt::format("{} of {}; {} % of the image", counts, kEnough, covered);
}

}  // namespace tankrig::app
