#include "apps/tankrig/bench/evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "apps/tankrig/bench/external_cloud.hpp"
#include "apps/tankrig/bench/point_pictures.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "bench/benchmark/function.hpp"
#include "bench/benchmark/point_store.hpp"
#include "bench/metrics/bootstrap.hpp"
#include "bench/metrics/metrics_json.hpp"
#include "bench/metrics/uwsim_metrics.hpp"
#include "bench/sweep/sweep_values.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"
#include "session/reading/session_yaml.hpp"

using nlohmann::ordered_json;

namespace tankrig::app {
namespace {

ordered_json or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json interval_json(const std::optional<Interval>& interval) {
  return interval ? ordered_json(*interval) : ordered_json(nullptr);
}

/// Twice the sampling error, kept within what a share can be.
ordered_json share_interval(double share, double sigma) {
  return Interval{std::max(0.0, share - 1.96 * sigma), std::min(1.0, share + 1.96 * sigma)};
}

/// The cloud as far as the frames up to `t` give it; a point of no known frame is there from the end of the first dark
/// block.
PointCloud cloud_until(const PointCloud& cloud, const std::vector<double>& frame_times, double otherwise, double t) {
  PointCloud out;
  out.frame = cloud.frame;
  for (const CloudPoint& point : cloud.points) {
    const auto frame = static_cast<std::size_t>(point.frame);
    if ((point.frame >= 0 && frame < frame_times.size() ? frame_times[frame] : otherwise) <= t)
      out.points.push_back(point);
  }
  return out;
}

}  // namespace

Evaluation::Evaluation(Benchmark benchmark, const RigConfig& rig, const sim::WorldOptions& world)
    : benchmark_(std::move(benchmark)),
      world_(world),
      names_(benchmark_names(rig)),
      parameters_(pipeline_parameters(rig.root)),
      object_(read_mesh(rig.object.mesh), parameters_.thresholds.surface_samples),
      measured_(benchmark_.measures.size(), true) {
  identity_ = {{"format", "tankrig-bench 1"},
               {"benchmark", benchmark_.file.filename().string()},
               {"benchmark_sha256", sha256_of_text(read_whole_file(benchmark_.file))},
               {"rig", rig.name},
               {"rig_sha256", sha256_of_text(resolved_rig_yaml(rig, rig.object.mesh.filename().string()))},
               {"object_sha256", sha256_of_text(read_whole_file(rig.object.mesh))},
               {"software", TANKRIG_VERSION},
               {"sensor", world_.sensor.value_or("scene")},
               {"seed", world_.seed}};
  if (!rig.scene.empty()) identity_["scene_sha256"] = sha256_of_text(read_whole_file(rig.scene));
  if (!rig.preset.empty()) identity_["preset"] = rig.preset;
  find_programs();
}

std::string Evaluation::known_clouds() const {
  std::string out;
  for (const std::string& method : kMethods) out += (out.empty() ? "" : ", ") + method;
  for (const Algorithm& external : benchmark_.algorithms) out += ", " + external.name;
  return out;
}

void Evaluation::find_programs() {
  std::erase_if(benchmark_.algorithms, [&](Algorithm& algorithm) {
    const std::string place =
        fmt::format("{}:{}: <algorithm> {}: ", benchmark_.file.string(), algorithm.line, algorithm.name);
    if (std::find(kMethods.begin(), kMethods.end(), algorithm.name) != kMethods.end())
      throw InputError(place + "found the name of a cloud of ours, expected another");
    const auto program = program_file(algorithm.program, benchmark_.file.parent_path());
    if (!program) {
      refusals_.push_back(place + "'" + algorithm.program.string() +
                          "' is no program, expected an executable file; left out");
      return true;
    }
    algorithm.program = *program;
    identity_["algorithms"][algorithm.name] = sha256_of_text(read_whole_file(algorithm.program));
    return false;
  });
}

std::vector<std::string> Evaluation::programs() const {
  std::vector<std::string> out;
  for (const Algorithm& algorithm : benchmark_.algorithms)
    out.push_back(algorithm.name + ": " + algorithm.program.string());
  return out;
}

const Algorithm* Evaluation::algorithm(const std::string& cloud) const {
  const auto found = std::ranges::find(benchmark_.algorithms, cloud, &Algorithm::name);
  return found == benchmark_.algorithms.end() ? nullptr : &*found;
}

bool Evaluation::uses_laser(const std::string& cloud) const {
  const Algorithm* const external = algorithm(cloud);
  return external ? external->by_laser : by_laser(cloud);
}

bool Evaluation::has_cloud(const std::string& cloud) const {
  return algorithm(cloud) || std::find(kMethods.begin(), kMethods.end(), cloud) != kMethods.end();
}

std::string Evaluation::cloud_of(const Measure& measure, const Condition& condition) const {
  return measure.topic == kChosenCloud && !condition.cloud.empty() ? condition.cloud : names_.of(measure.topic);
}

std::string Evaluation::measured_cloud(std::size_t index, const Condition& condition) const {
  const Measure& measure = benchmark_.measures[index];
  return measured_[index] && measure.kind == MeasureKind::kReconstruction3D ? cloud_of(measure, condition) : "";
}

Score Evaluation::score(const MeasuredScan& scan, const Session& session, const Session& believed,
                        const std::string& cloud) const {
  const Algorithm* const external = algorithm(cloud);
  const std::string eyes = external ? (external->by_laser ? "laser" : "stereo") : cloud;
  return score_reconstruction(session, parameters_.thresholds, object_,
                              external ? external_reconstruction(*external, {believed, scan.joints(), scan.rig_yaml()},
                                                                 parameters_.workspace, StopOnSignal::requested())
                                       : reconstruct_session(believed, parameters_, cloud),
                              scan.ceiling(object_, eyes, parameters_.thresholds));
}

std::string Evaluation::unknown_name(const Updater& updater) const {
  for (const std::string& cloud : updater.clouds)
    if (!has_cloud(names_.of(cloud)))
      return "this rig has no cloud '" + cloud + "', expected one of: " + known_clouds();
  if (updater.kind == UpdaterKind::kArmMove && names_.of(updater.target) != "end_effector" &&
      names_.of(updater.target) != "arm")
    return "this rig has no arm '" + updater.target + "', expected arm";
  return "";
}

void Evaluation::refuse(const Updater& updater, const std::string& why) {
  refusals_.push_back(
      fmt::format("{}:{}: <{}>: {}", benchmark_.file.string(), updater.line, name_of(updater.kind), why));
}

void Evaluation::leave_out_loops(const std::function<std::string(const Updater&)>& why) {
  std::erase_if(benchmark_.updaters, [&](const Updater& updater) {
    const std::string reason = why(updater);
    if (reason.empty()) return false;
    refuse(updater, reason + "; its loop is left out");
    identity_[kLoopsLeftOut].push_back(updater.line);
    return true;
  });
}

void Evaluation::refuse_measures(const RunTrace& trace) {
  const auto refuse = [&](int line, const std::string& what, const std::string& why) {
    refusals_.push_back(fmt::format("{}:{}: {}: {}", benchmark_.file.string(), line, what, why));
  };
  for (const auto& [trigger, what] : {std::pair{&benchmark_.start, "<startOn>"}, {&benchmark_.stop, "<stopOn>"}}) {
    const std::string why = trigger_refusal(*trigger, trace, names_);
    if (why.empty()) continue;
    refuse(trigger->line, what, why + "; " + (trigger == &benchmark_.start ? "starts at once" : "never stops"));
    trigger->kind = trigger == &benchmark_.start ? TriggerKind::kOnInit : TriggerKind::kNever;
  }
  const Condition first = condition(0);
  for (std::size_t i = 0; i < benchmark_.measures.size(); ++i) {
    const Measure& measure = benchmark_.measures[i];
    std::string why = measure_refusal(measure, trace, names_);
    const bool cloud = measure.kind == MeasureKind::kReconstruction3D;
    if (why.empty() && cloud && names_.of(measure.target) != "object")
      why = "'" + measure.target + "' has no mesh, expected object";
    if (why.empty() && cloud && !has_cloud(cloud_of(measure, first)))
      why = "this rig has no cloud '" + measure.topic + "', expected one of: " + known_clouds();
    if (why.empty()) continue;
    measured_[i] = false;
    refuse(measure.line, "<" + std::string(name_of(measure.kind)) + "> " + measure.name, why + "; left out");
  }
}

void Evaluation::measure_cloud(const Measure& measure, const MeasuredScan& scan, const RunTrace& trace,
                               const Score& score, ordered_json& row) const {
  const PointCloud cloud = cloud_in_object(scan.recorded(), score.reconstruction);
  MetricThresholds thresholds = parameters_.thresholds;
  if (measure.level_of_detail) thresholds.coverage_headline_m = *measure.level_of_detail;
  const bool uwsim = measure.arithmetic == Arithmetic::kUwsim;
  const double step = measure.level_of_detail.value_or(kLevelOfDetail);
  const auto values_of = [&](const PointCloud& part) -> std::vector<ordered_json> {
    if (uwsim) {
      const UwsimMetrics m = uwsim_metrics(part, object_.mesh(), step);
      const auto variance = std::isfinite(m.error_variance_m2) ? ordered_json(m.error_variance_m2) : ordered_json();
      return {m.mean_error_m, variance, m.coverage, m.outliers};
    }
    const Metrics m = tankrig::evaluate(part, object_, thresholds, &score.ceiling);
    return {m.error ? ordered_json(m.error->mean) : ordered_json(), m.error ? or_null(m.error->stddev) : ordered_json(),
            m.headline().whole, or_null(m.outliers), or_null(m.headline().of_ceiling)};
  };
  ordered_json& out = row["measures"][measure.name];
  const std::vector<std::string>& details = details_of(measure.kind, measure.arithmetic);
  const std::vector<bool> counts = counting(benchmark_, measure, trace, names_);
  std::vector<double> frame_times;
  for (const FrameRecord& frame : scan.recorded().frames) {
    if (frame.camera != scan.recorded().camera(CameraRole::kMono).name) continue;
    const auto index = static_cast<std::size_t>(frame.index);
    frame_times.resize(std::max(frame_times.size(), index + 1));
    frame_times[index] = seconds(frame.stamp - scan.recorded().frames.front().stamp) + trace.frames.front().t_s;
  }
  const bool laser = uses_laser(score.method());
  double dark = 0;
  for (const TraceSample& sample : trace.samples)
    if (sample.phase == Phase::kDarkBefore) dark = sample.t_s;
  const auto until = [&](double t) { return cloud_until(cloud, laser ? frame_times : std::vector<double>(), dark, t); };

  // As the reference does, points count while the measure does.
  const auto last = std::find(counts.rbegin(), counts.rend(), true);
  const auto first = std::find(counts.begin(), counts.end(), true);
  if (first == counts.end()) {
    for (const std::string& detail : details) out[detail] = nullptr;
    return;
  }
  const auto sample_of = [&](auto place) { return static_cast<std::size_t>(place - counts.begin()); };
  const std::size_t end = counts.size() - static_cast<std::size_t>(last - counts.rbegin()) - 1;
  const bool whole = sample_of(first) == 0 && end + 1 == counts.size();
  PointCloud counted = whole ? cloud : until(trace.samples[end].t_s);
  if (!whole && laser)
    std::erase_if(counted.points, [&](const CloudPoint& p) {
      return p.frame >= 0 && frame_times.at(static_cast<std::size_t>(p.frame)) < trace.samples[sample_of(first)].t_s;
    });
  const std::vector<ordered_json> values = values_of(counted);
  for (std::size_t i = 0; i < details.size(); ++i) out[details[i]] = values[i];
  if (!uwsim) {
    const Metrics m = tankrig::evaluate(counted, object_, thresholds, &score.ceiling);
    const ErrorIntervals intervals = bootstrap_errors(counted, m);
    const Coverage& headline = m.headline();
    out["interval95"] = {{"mean_error", interval_json(intervals.mean)},
                         {"stddev", interval_json(intervals.stddev)},
                         {"coverage", share_interval(headline.whole, headline.whole_sigma)},
                         {"outliers", interval_json(intervals.outliers)}};
    if (headline.of_ceiling)
      out["interval95"]["of_ceiling"] = share_interval(*headline.of_ceiling, headline.of_ceiling_sigma.value_or(0));
    out["drawn"] = {{"groups", intervals.groups}, {"by_frame", intervals.by_frame}};
    out["metrics"] = to_json(m);
  }
  if (!score.reconstruction.reason.empty())
    out[algorithm(score.method()) ? "error" : "reason"] = score.reconstruction.reason;
  if (!score.reconstruction.warning.empty()) out["warning"] = score.reconstruction.warning;
  if (!measure.log_s) return;
  ordered_json& log = row["logs"][measure.name] = ordered_json::array();
  std::size_t points = 0;
  std::vector<ordered_json> now = values_of({});
  for (double t = *measure.log_s; t <= trace.samples[end].t_s; t += *measure.log_s) {
    const PointCloud part = until(t);
    if (part.points.size() != points) now = values_of(part);
    points = part.points.size();
    log.push_back(ordered_json::array({t}));
    for (const ordered_json& value : now) log.back().push_back(value);
  }
}

std::vector<PointView> Evaluation::views(const Session& session, const Condition& at,
                                         const std::map<std::string, Score>& scores) const {
  std::vector<PointView> out = frame_views(session);
  for (const Measure* measure : clouds_of(benchmark_))
    if (const auto score = scores.find(cloud_of(*measure, at)); score != scores.end())
      out.push_back(cloud_view(session, score->second, measure->name,
                               session.camera(uses_laser(score->first) ? CameraRole::kMono : CameraRole::kLeft),
                               object_.mesh()));
  return out;
}

Evaluated Evaluation::evaluate(std::size_t point, const MeasuredScan& scan) const {
  Evaluated evaluated{{{"values", benchmark_.values(point)}}, {}};
  ordered_json& row = evaluated.row;
  try {
    const Condition at = condition(point);
    std::set<std::string> clouds;
    for (std::size_t i = 0; i < measured_.size(); ++i)
      if (const std::string cloud = measured_cloud(i, at); !cloud.empty()) clouds.insert(cloud);
    const auto wants = [&](bool laser) {
      return std::ranges::any_of(clouds, [&](const auto& cloud) { return uses_laser(cloud) == laser; });
    };
    const Session session = scan.session(at.pictures, wants(true), wants(false));
    Session believed = session;
    for (const CalibrationError& error : at.errors) put_error(error, believed.info);
    RunTrace trace = scan.trace();
    trace.lux = scan.lux(at.pictures);
    std::map<std::string, Score> scores;
    for (const std::string& cloud : clouds) {
      scores[cloud] = score(scan, session, believed, cloud);
      if (algorithm(cloud) && StopOnSignal::requested()) return {nullptr, {}};
    }
    if (is_viewed(benchmark_, point)) evaluated.views = views(session, at, scores);
    DetailValues values;
    for (std::size_t i = 0; i < measured_.size(); ++i) {
      const Measure& measure = benchmark_.measures[i];
      ordered_json& out = row["measures"][measure.name] = ordered_json::object();
      const std::vector<std::string>& details = details_of(measure.kind, measure.arithmetic);
      if (!measured_[i]) {
        out["left_out"] = true;
        continue;
      }
      if (measure.kind == MeasureKind::kReconstruction3D) {
        measure_cloud(measure, scan, trace, scores.at(cloud_of(measure, at)), row);
      } else {
        const std::vector<bool> counts = counting(benchmark_, measure, trace, names_);
        const auto found = trace_values(measure, trace, names_, counts, counts.size());
        for (std::size_t k = 0; k < details.size(); ++k) out[details[k]] = or_null(found[k]);
        if (measure.log_s) {
          ordered_json& log = row["logs"][measure.name] = ordered_json::array();
          double next = *measure.log_s;
          for (std::size_t s = 0; s < counts.size(); ++s) {
            if (trace.samples[s].t_s < next) continue;
            next += *measure.log_s;
            log.push_back(ordered_json::array({trace.samples[s].t_s}));
            for (const auto& value : trace_values(measure, trace, names_, counts, s + 1))
              log.back().push_back(or_null(value));
          }
        }
      }
      const ordered_json& filled = row["measures"][measure.name];
      for (std::size_t k = 0; k < details.size(); ++k) {
        if (!filled[details[k]].is_number()) continue;
        values[measure.name + "." + details[k]] = filled[details[k]].get<double>();
        if (k == 0) values[measure.name] = filled[details[k]].get<double>();
      }
    }
    for (const Function& function : benchmark_.functions)
      row["functions"][function.name] = or_null(function_value(function.expression, values));
    row["simulated_s"] = scan.recorded().info.simulated_s;
    row["lux"] = or_null(trace.lux);
  } catch (const std::exception& e) {
    row = {{"values", benchmark_.values(point)}, {"error", printable(e.what())}};
  }
  return evaluated;
}

}  // namespace tankrig::app
