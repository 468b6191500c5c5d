#include "calibration/joint/joint.hpp"

#include <algorithm>

#include "calibration/joint/joint_fit.hpp"
#include "calibration/joint/joint_start.hpp"

namespace tankrig {

BoardBundle seen_from(const BoardBundle& boards, std::size_t camera) {
  BoardBundle out = boards;
  const auto first = static_cast<std::ptrdiff_t>(camera);
  const auto turn = [first](auto& of_cameras) {
    std::rotate(of_cameras.begin(), of_cameras.begin() + first, of_cameras.begin() + first + 1);
  };
  const Transform kMc = boards.kMc[camera], cMk = kMc.inverse();
  for (Transform& iMc : out.kMc) iMc = iMc * cMk;
  out.kMc[camera] = Transform::Identity();
  turn(out.cameras), turn(out.kMc);
  for (BoardView& view : out.views) turn(view.seen);
  for (Transform& cMt : out.cMt) cMt = kMc * cMt;
  return out;
}

const Estimate* JointSolution::parameter(const std::string& name) const {
  const auto found =
      std::find_if(parameters.begin(), parameters.end(), [&](const Estimate& e) { return e.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

JointSolution solve(const JointProblem& problem) {
  check(problem);
  return solution_of(JointFit(problem));
}

}  // namespace tankrig
