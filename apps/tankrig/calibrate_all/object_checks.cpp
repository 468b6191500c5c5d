#include "apps/tankrig/calibrate_all/object_checks.hpp"

#include <cmath>

#include "bench/metrics/alignment.hpp"
#include "core/input_error.hpp"
#include "pipeline/score_session.hpp"

namespace tankrig::app {
namespace {

// tank-true just calibrated: 0.2 mm by laser, 0.4 mm by stereo, 1.3 mm apart. A milliradian of the laser's sheet is a
// millimetre and more.
constexpr double kOffLimit_mm = 1.0, kApartLimit_mm = 3.0;
constexpr double kMissLimit = 70;  // % of a method's points
constexpr double kPercent = 100;

}  // namespace

ObjectChecks object_checks(const Session& session, Progress& progress) {
  const PipelineParameters parameters = pipeline_parameters(session);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  ObjectChecks out;
  std::vector<Transform> seen;  // where the object lies on each method's points, in o
  for (const std::string method : {"laser", "stereo"}) {
    const Reconstruction found = reconstruct_session(session, parameters, method, progress.callback());
    const PointCloud cloud = cloud_in_object(session, found);
    const AlignedScore laid =
        evaluate_aligned(cloud, object, parameters.thresholds, evaluate(cloud, object, parameters.thresholds));
    const double missed = kPercent * (1 - laid.registration.share);
    if (!laid.doubt.empty() && missed <= kMissLimit)
      throw InputError(session.path, method + ": " + laid.doubt + ", expected three faces of the object in view");
    if (!laid.metrics || !laid.metrics->error) {
      out.checks.push_back({method + ": points beside the object", missed, kMissLimit, "%"});
      continue;
    }
    out.checks.push_back({method + ": points off the object", 1e3 * laid.metrics->error->mean, kOffLimit_mm, "mm"});
    seen.push_back(laid.registration.aMb.inverse());
  }
  if (seen.size() < 2) return out;
  double squares = 0;
  for (const SurfaceSample& sample : object.samples())
    squares += (seen[0] * sample.p - seen[1] * sample.p).squaredNorm();
  out.checks.push_back({"laser and stereo: object apart",
                        1e3 * std::sqrt(squares / static_cast<double>(object.samples().size())), kApartLimit_mm, "mm"});
  out.moved = seen[1];
  return out;
}

}  // namespace tankrig::app
