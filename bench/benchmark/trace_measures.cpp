// The measures that look at the rig's motion, frames and supply.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "bench/benchmark/function.hpp"
#include "bench/benchmark/run_trace.hpp"

namespace tankrig {
namespace {

constexpr double kMaxCollisionSpeed = 0.5;  ///< the reference module's [m/s]
constexpr double kSupply = 24;              ///< of the arm, its nominal voltage [V]

using Values = std::vector<std::optional<double>>;

class Evaluation {
 public:
  Evaluation(const Measure& measure, const RunTrace& trace, const BenchmarkNames& names,
             const std::vector<bool>& counts, std::size_t samples)
      : measure_(measure), trace_(trace), names_(names) {
    for (std::size_t i = 0; i < samples; ++i)
      if (counts[i]) counted_.push_back(i);
  }

  Values values() const {
    const std::size_t details = details_of(measure_.kind, measure_.arithmetic).size();
    if (counted_.empty()) return Values(details);
    switch (measure_.kind) {
      case MeasureKind::kTime:
        return {over_steps([](const TraceSample& a, const TraceSample& b) { return b.t_s - a.t_s; })};
      case MeasureKind::kCollision:
        return collision();
      case MeasureKind::kPositionError:
        return position_error();
      case MeasureKind::kDistance:
        return {over_steps([&](const TraceSample& a, const TraceSample& b) { return moved(measure_.target, a, b); })};
      case MeasureKind::kEuclideanNorm:
        return {euclidean_norm()};
      case MeasureKind::kObjectCenteredOnCam:
        return centred();
      case MeasureKind::kPathFollowing:
        return path_following();
      case MeasureKind::kEnergy: {
        const double charge = over_steps([](const TraceSample& a, const TraceSample& b) {
          return 0.5 * (a.current_a + b.current_a) * (b.t_s - a.t_s);
        });
        return {kSupply * charge, charge};
      }
      case MeasureKind::kSyncResidual:
        return sync_residual();
      case MeasureKind::kSweepVelocityError:
        return sweep_velocity_error();
      case MeasureKind::kFramesLost:
        return {static_cast<double>(trace_.frames_lost), static_cast<double>(frames_counted().size())};
      case MeasureKind::kReconstruction3D:
        break;
    }
    return Values(details);
  }

 private:
  const TraceSample& last() const { return trace_.samples[counted_.back()]; }

  Transform pose(const std::string& body, const TraceSample& sample) const {
    return trace_.bodies.at(names_.of(body))(sample.q);
  }
  double moved(const std::string& body, const TraceSample& a, const TraceSample& b) const {
    return (pose(body, b).translation() - pose(body, a).translation()).norm();
  }

  /// Sum over pairs of neighbouring samples that both count.
  template <class Step>
  double over_steps(Step step) const {
    double sum = 0;
    for (std::size_t k = 1; k < counted_.size(); ++k)
      if (counted_[k] == counted_[k - 1] + 1) sum += step(trace_.samples[counted_[k - 1]], trace_.samples[counted_[k]]);
    return sum;
  }

  Values collision() const {
    double sum = 0, fastest = 0, nearest = trace_.samples[counted_.front()].clearance_m;
    std::size_t contacts = 0;
    for (const std::size_t i : counted_) {
      const TraceSample& sample = trace_.samples[i];
      nearest = std::min(nearest, sample.clearance_m);
      if (sample.clearance_m > 0) continue;
      ++contacts;
      if (i == 0) continue;
      const TraceSample& before = trace_.samples[i - 1];
      const double speed = moved(measure_.target, before, sample) / (sample.t_s - before.t_s);
      sum += speed;
      fastest = std::max(fastest, speed);
    }
    const double ticks = static_cast<double>(counted_.size());
    const double score = 1 - sum / (ticks * kMaxCollisionSpeed) - fastest / kMaxCollisionSpeed;
    return {std::max(0.0, score), static_cast<double>(contacts), nearest};
  }

  Values position_error() const {
    const Transform wMt = pose(measure_.target, last());
    const Vector3d wanted = measure_.topic.empty()
                                ? measure_.position
                                : Vector3d(pose(measure_.topic, trace_.samples[counted_.front()]).translation());
    const Vector3d error = wMt.translation() - wanted;
    const Eigen::Quaterniond rotation(wMt.linear());
    return {error.norm(), error.x(), error.y(), error.z(), rotation.x(), rotation.y(), rotation.z(), rotation.w()};
  }

  /// Pixels of the target's corners; nothing if one cannot be projected.
  std::optional<std::vector<cv::Point2f>> outline() const {
    const TraceCamera& camera = trace_.cameras.at(names_.of(measure_.truth.camera));
    const Transform cMo = camera.wMc.inverse() * pose(measure_.truth.target, last());
    std::vector<cv::Point2f> points;
    for (const Vector3d& corner : trace_.corners.at(names_.of(measure_.truth.target))) {
      const auto pixel = camera.model.project(cMo * corner);
      if (!pixel) return std::nullopt;
      points.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    }
    return points;
  }

  std::optional<std::vector<double>> truth() const {
    const GroundTruth& truth = measure_.truth;
    if (truth.kind == GroundTruthKind::kConstant) return truth.values;
    if (truth.kind == GroundTruthKind::kRelativeLocation) {
      const Vector3d p = (pose(truth.from, last()).inverse() * pose(truth.to, last())).translation();
      return std::vector<double>{p.x(), p.y(), p.z()};
    }
    const auto points = outline();
    if (!points) return std::nullopt;
    if (truth.kind == GroundTruthKind::kCentroidFromCamera) {
      std::vector<cv::Point2f> hull;
      cv::convexHull(*points, hull);
      const cv::Moments m = cv::moments(hull);
      if (!(m.m00 > 0)) return std::nullopt;
      return std::vector<double>{m.m10 / m.m00, m.m01 / m.m00};
    }
    std::vector<double> corners;
    std::array<cv::Point2f, 4> rectangle;
    cv::minAreaRect(*points).points(rectangle.data());
    for (const cv::Point2f& corner : rectangle) corners.insert(corners.end(), {corner.x, corner.y});
    return corners;
  }

  /// Without a value if the stream has another number of values than the truth.
  std::optional<double> euclidean_norm() const {
    const std::vector<double> found = trace_.numbers.at(names_.of(measure_.target))(last());
    const auto wanted = truth();
    if (!wanted || wanted->size() != found.size()) return std::nullopt;
    return std::sqrt(std::inner_product(found.begin(), found.end(), wanted->begin(), 0.0, std::plus<>(),
                                        [](double a, double b) { return (a - b) * (a - b); }));
  }

  Values centred() const {
    const TraceCamera& camera = trace_.cameras.at(names_.of(measure_.camera));
    const auto pixel = camera.model.project(camera.wMc.inverse() * pose(measure_.target, last()).translation());
    if (!pixel) return Values(3);
    const Vector2d off = *pixel - 0.5 * Vector2d(camera.model.width - 1, camera.model.height - 1);
    return {off.norm(), off.x(), off.y()};
  }

  Values path_following() const {
    const auto error = [&](const TraceSample& sample) {
      TraceSample planned = sample;
      planned.q = sample.planned_q;
      return moved(measure_.target, sample, planned);
    };
    const double sum = over_steps(
        [&](const TraceSample& a, const TraceSample& b) { return 0.5 * (error(a) + error(b)) * (b.t_s - a.t_s); });
    return {sum, error(last()), static_cast<double>(last().segment)};
  }

  std::vector<const TraceFrame*> frames_counted() const {
    std::vector<const TraceFrame*> out;
    const double begin = trace_.samples[counted_.front()].t_s;
    for (const TraceFrame& frame : trace_.frames)
      if (frame.t_s >= begin && frame.t_s <= last().t_s) out.push_back(&frame);
    return out;
  }

  Values sync_residual() const {
    std::vector<double> residuals;
    double on_target = 0;
    for (const TraceFrame* frame : frames_counted()) {
      residuals.push_back(frame->sync_residual_s);
      on_target = std::max(on_target, frame->on_target_m);
    }
    if (residuals.empty()) return Values(3);
    std::sort(residuals.begin(), residuals.end());
    const auto rank = static_cast<std::size_t>(std::ceil(0.99 * static_cast<double>(residuals.size()))) - 1;
    return {residuals[rank], residuals.back(), on_target};
  }

  /// Of the joint that sweeps fastest, at the plan's constant velocity.
  Values sweep_velocity_error() const {
    double squares = 0, largest = 0;
    std::size_t n = 0;
    for (const std::size_t i : counted_) {
      const TraceSample& sample = trace_.samples[i];
      if (sample.phase != Phase::kSweep) continue;
      const double error = (sample.velocity - sample.planned_velocity).cwiseAbs().maxCoeff();
      squares += error * error;
      largest = std::max(largest, error);
      ++n;
    }
    if (n == 0) return Values(2);
    return {std::sqrt(squares / static_cast<double>(n)), largest};
  }

  const Measure& measure_;
  const RunTrace& trace_;
  const BenchmarkNames& names_;
  std::vector<std::size_t> counted_;
};

}  // namespace

std::vector<std::optional<double>> trace_values(const Measure& measure, const RunTrace& trace,
                                                const BenchmarkNames& names, const std::vector<bool>& counts,
                                                std::size_t samples) {
  return Evaluation(measure, trace, names, counts, samples).values();
}

}  // namespace tankrig
