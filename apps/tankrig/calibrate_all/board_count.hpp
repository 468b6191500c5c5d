// What the boards step has so far: which pictures count, for each camera and for pairs of them, and what is still missing.
#pragma once

#include <string>
#include <vector>

#include "calibration/boards/counted_pictures.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

class BoardCount {
 public:
  static constexpr std::size_t kEnough = 10, kEnoughShared = 6;  ///< pictures that count, of a camera and of a pair

  /// `cameras`: the first is the one that the others are placed in.
  explicit BoardCount(const std::vector<const RigCamera*>& cameras);

  /// One moment: a search for each camera. Says of each why it does not count; empty: it does.
  std::vector<std::string> add(const std::vector<BoardSearch>& moment);

  std::size_t pictures() const;  ///< that count, of all cameras
  std::size_t pictures(std::size_t camera) const { return cameras_[camera].count(); }
  double covered(std::size_t camera) const { return cameras_[camera].covered(); }  ///< share of its image
  /// Empty: enough. Else what to show which camera.
  std::string missing() const;
  /// "left 9, mono 7, right 8 of 10; 64, 80, 51 % of the image".
  std::string so_far() const;
  const std::string& name(std::size_t camera) const { return names_[camera]; }

 private:
  std::vector<std::string> names_;
  std::vector<CountedPictures> cameras_;
  std::vector<std::size_t> shared_;  ///< moments that count for the first camera and this one
};

}  // namespace tankrig::app
