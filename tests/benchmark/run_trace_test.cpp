// Triggers and measures on motions whose answers are known by hand.
#include "bench/benchmark/run_trace.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/benchmark/function.hpp"

namespace tankrig {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Optional;

/// 10 s at 0.1 s: at rest for 2 s, then 0.1 m/s along x for 5 s, then at rest. Joint 0 is the place along x, and the
/// plan is 5 mm ahead. The move is the sweep.
RunTrace moving() {
  RunTrace trace;
  for (int i = 0; i <= 100; ++i) {
    TraceSample sample;
    sample.t_s = 0.1 * i;
    sample.q[0] = 0.1 * std::clamp(sample.t_s - 2, 0.0, 5.0);
    sample.phase = i < 20 ? Phase::kDarkBefore : i < 70 ? Phase::kSweep : Phase::kDarkAfter;
    if (sample.phase == Phase::kSweep) sample.velocity[0] = 0.11, sample.planned_velocity[0] = 0.1;
    sample.planned_q = sample.q;
    sample.planned_q[0] += 0.005;
    sample.segment = i / 10;
    sample.current_a = 2;
    trace.samples.push_back(sample);
  }
  trace.bodies["gripper"] = [](const JointVector& q) { return make_transform_rpy({q[0], 0, 0}, Vector3d::Zero()); };
  trace.bodies["box"] = [](const JointVector&) { return make_transform_rpy({0.1, 0.2, 1}, Vector3d::Zero()); };
  trace.corners["box"] = {{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};
  TraceCamera camera;
  camera.model = {640, 480, 500, 500, 319.5, 239.5};
  trace.cameras["eye"] = camera;
  trace.numbers["place"] = [](const TraceSample& s) { return std::vector<double>{s.q[0], 0}; };
  trace.frames = {{2.5, 0.001, 0.0002}, {3.5, 0.003, 0.0001}, {9, 0.5, 0.1}};
  trace.frames_lost = 4;
  trace.lux = 147;
  return trace;
}

Trigger trigger(TriggerKind kind, const std::string& target = "", double value = 0) {
  Trigger out;
  out.kind = kind;
  out.target = target;
  out.value = value;
  return out;
}

/// When it starts and when it is last on [s]; -1: never.
std::pair<double, double> on(const Trigger& t, Arithmetic arithmetic = Arithmetic::kPaper) {
  const RunTrace trace = moving();
  EXPECT_THAT(trigger_refusal(t, trace, {}), IsEmpty());
  const std::vector<bool> is = triggered(t, trace, {}, arithmetic);
  std::pair<double, double> out{-1, -1};
  for (std::size_t i = 0; i < is.size(); ++i) {
    if (!is[i]) continue;
    if (out.first < 0) out.first = trace.samples[i].t_s;
    out.second = trace.samples[i].t_s;
  }
  return out;
}

void expect_on(const Trigger& t, double first, double last, Arithmetic arithmetic = Arithmetic::kPaper) {
  const auto [begin, end] = on(t, arithmetic);
  EXPECT_NEAR(begin, first, 0.051);
  EXPECT_NEAR(end, last, 0.051);
}

TEST(BenchmarkTrigger, StartsWhenItShould) {
  expect_on(trigger(TriggerKind::kOnInit), 0, 10);
  expect_on(trigger(TriggerKind::kNever), -1, -1);
  expect_on(trigger(TriggerKind::kService, "scan_start"), 0, 10);
  expect_on(trigger(TriggerKind::kService, "sweep_start"), 2, 10);
  expect_on(trigger(TriggerKind::kService, "sweep_end"), 7, 10);
  expect_on(trigger(TriggerKind::kTopic, "sweeping"), 2, 6.9);
  expect_on(trigger(TriggerKind::kScanPhase, "dark_after"), 7, 10);
  expect_on(trigger(TriggerKind::kJointAngle, "slew", 0.25), 4.5, 10);
  expect_on(trigger(TriggerKind::kLuxLevel, "", 147), 0, 10);
  expect_on(trigger(TriggerKind::kLuxLevel, "", 148), -1, -1);
}

TEST(BenchmarkTrigger, DistancesAreMetresAndWithTheReferencesArithmeticTheirRoots) {
  expect_on(trigger(TriggerKind::kOnMove, "gripper"), 4.05, 10);                     // 0.2 m
  expect_on(trigger(TriggerKind::kOnMove, "gripper"), 6.5, 10, Arithmetic::kUwsim);  // 0.447 m
  Trigger place = trigger(TriggerKind::kPosition, "gripper");
  place.position = {0.7, 0, 0};
  expect_on(place, 6.05, 10);                     // 0.3 m before it
  expect_on(place, 3.6, 10, Arithmetic::kUwsim);  // 0.548 m
  expect_on(trigger(TriggerKind::kOnNoMove, "box"), 4, 10);
}

TEST(BenchmarkTrigger, NamesWhatTheRigDoesNotHave) {
  const RunTrace trace = moving();
  EXPECT_THAT(trigger_refusal(trigger(TriggerKind::kOnMove, "girona500"), trace, {}),
              HasSubstr("no body 'girona500' (no free vehicle), expected one of: box, gripper"));
  EXPECT_THAT(trigger_refusal(trigger(TriggerKind::kService, "startBench"), trace, {}), HasSubstr("no command"));
  EXPECT_THAT(trigger_refusal(trigger(TriggerKind::kService, "startBench"), trace, {{{"startBench", "scan_start"}}}),
              IsEmpty());
}

Measure measure(MeasureKind kind, const std::string& target = "") {
  Measure out;
  out.kind = kind;
  out.name = "m";
  out.target = target;
  out.start = trigger(TriggerKind::kOnInit);
  out.stop = trigger(TriggerKind::kNever);
  return out;
}

std::vector<std::optional<double>> values(const Measure& m, const RunTrace& trace = moving()) {
  EXPECT_THAT(measure_refusal(m, trace, {}), IsEmpty());
  Benchmark benchmark;
  benchmark.start = trigger(TriggerKind::kOnInit);
  benchmark.stop = trigger(TriggerKind::kNever);
  const auto counts = counting(benchmark, m, trace, {});
  const auto out = trace_values(m, trace, {}, counts, counts.size());
  EXPECT_EQ(out.size(), details_of(m.kind, m.arithmetic).size());
  return out;
}

auto about(double value) { return Optional(DoubleNear(value, 1e-6)); }

TEST(BenchmarkMeasure, CountsBetweenStartAndStop) {
  Measure time = measure(MeasureKind::kTime);
  EXPECT_THAT(values(time), ElementsAre(about(10)));
  time.start = trigger(TriggerKind::kScanPhase, "sweep");
  time.stop = trigger(TriggerKind::kScanPhase, "dark_after");
  EXPECT_THAT(values(time), ElementsAre(about(4.9)));
  time.start = trigger(TriggerKind::kNever);
  EXPECT_THAT(values(time), ElementsAre(std::nullopt));
}

TEST(BenchmarkMeasure, FollowsTheMotion) {
  EXPECT_THAT(values(measure(MeasureKind::kDistance, "gripper")), ElementsAre(about(0.5)));
  EXPECT_THAT(values(measure(MeasureKind::kDistance, "box")), ElementsAre(about(0)));
  EXPECT_THAT(values(measure(MeasureKind::kPathFollowing, "gripper")),
              ElementsAre(about(0.05), about(0.005), about(10)));
  Measure place = measure(MeasureKind::kPositionError, "gripper");
  place.position = {0.2, 0, 0.4};
  EXPECT_THAT(values(place),
              ElementsAre(about(0.5), about(0.3), about(0), about(-0.4), about(0), about(0), about(0), about(1)));
  place.topic = "gripper";  // where it began
  EXPECT_THAT(values(place)[0], about(0.5));
}

TEST(BenchmarkMeasure, CollisionScoresByTheReferencesFormula) {
  RunTrace trace = moving();
  trace.bodies["end_effector"] = trace.bodies["gripper"];
  const Measure hits = measure(MeasureKind::kCollision, "end_effector");
  EXPECT_THAT(values(hits, trace), ElementsAre(about(1), about(0), about(1)));
  for (std::size_t i = 30; i < 40; ++i) trace.samples[i].clearance_m = -0.01;
  EXPECT_THAT(values(hits, trace), ElementsAre(about(1 - 10 * 0.1 / (101 * 0.5) - 0.1 / 0.5), about(10), about(-0.01)));
}

TEST(BenchmarkMeasure, LooksThroughCameras) {
  Measure centred = measure(MeasureKind::kObjectCenteredOnCam, "box");
  centred.camera = "eye";
  EXPECT_THAT(values(centred), ElementsAre(about(std::hypot(50, 100)), about(50), about(100)));
  Measure norm = measure(MeasureKind::kEuclideanNorm, "place");
  norm.truth.kind = GroundTruthKind::kConstant;
  norm.truth.values = {0.2, 0.4};
  EXPECT_THAT(values(norm), ElementsAre(about(0.5)));
  norm.truth.values = {0.2};
  EXPECT_THAT(values(norm), ElementsAre(std::nullopt));
  norm.truth.kind = GroundTruthKind::kCentroidFromCamera;
  norm.truth.camera = "eye";
  norm.truth.target = "box";
  EXPECT_THAT(values(norm), ElementsAre(about(std::hypot(369.5 - 0.5, 339.5))));
  norm.truth.kind = GroundTruthKind::kCornersFromCamera;
  RunTrace corners = moving();
  corners.numbers["place"] = [](const TraceSample&) { return std::vector<double>(8); };
  double squares = 0;
  for (const auto& [u, v] : {std::pair{319.5, 289.5}, {419.5, 289.5}, {419.5, 389.5}, {319.5, 389.5}})
    squares += u * u + v * v;
  EXPECT_THAT(values(norm, corners)[0], Optional(DoubleNear(std::sqrt(squares), 1e-3)));
  norm.truth.kind = GroundTruthKind::kRelativeLocation;
  norm.truth.from = "gripper";
  norm.truth.to = "box";
  corners.numbers["place"] = [](const TraceSample&) { return std::vector<double>{0, 0, 0}; };
  EXPECT_THAT(values(norm, corners), ElementsAre(about(Vector3d(-0.4, 0.2, 1).norm())));
}

TEST(BenchmarkMeasure, TellsOfTheRig) {
  EXPECT_THAT(values(measure(MeasureKind::kEnergy)), ElementsAre(about(480), about(20)));
  Measure sync = measure(MeasureKind::kSyncResidual);
  sync.stop = trigger(TriggerKind::kScanPhase, "dark_after");
  EXPECT_THAT(values(sync), ElementsAre(about(0.003), about(0.003), about(0.0002)));
  EXPECT_THAT(values(measure(MeasureKind::kSweepVelocityError)), ElementsAre(about(0.01), about(0.01)));
  EXPECT_THAT(values(measure(MeasureKind::kFramesLost)), ElementsAre(about(4), about(3)));
}

TEST(BenchmarkMeasure, NamesWhatTheRigDoesNotHave) {
  const RunTrace trace = moving();
  EXPECT_THAT(measure_refusal(measure(MeasureKind::kDistance, "girona500"), trace, {}), HasSubstr("'girona500'"));
  Measure norm = measure(MeasureKind::kEuclideanNorm, "cornersTopic");
  EXPECT_THAT(measure_refusal(norm, trace, {}),
              HasSubstr("no stream of numbers 'cornersTopic', expected one of: place"));
  EXPECT_THAT(measure_refusal(measure(MeasureKind::kCollision, "box"), trace, {}),
              HasSubstr("'box' does not move on this rig"));
}

}  // namespace
}  // namespace tankrig
