// A scan reconstructed while it is recorded: the same bits as from the session, and no harm whatever happens to it.
#include "pipeline/live_reconstruction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "reconstruction/stripe/stripe_reconstruction.hpp"
#include "session/recording/session_writer.hpp"
#include "tests/stripe/generated_stripe.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

constexpr int kDark = 3, kSweep = 12;
const std::atomic<bool> kGoOn{false};

/// A box on edge, in its own frame.
constexpr const char* kBox =
    "v 0 0 0\nv 0.2 0 0\nv 0.2 0.2 0\nv 0 0.2 0\nv 0 0 0.2\nv 0.2 0 0.2\nv 0.2 0.2 0.2\nv 0 0.2 0.2\n"
    "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 3 4 8\nf 3 8 7\nf 1 5 8\nf 1 8 4\nf 2 3 7\nf 2 7 6\n";

SessionInfo info_of_scan() {
  SessionInfo info;
  info.kind = "scan";
  CalibratedCamera camera;
  camera.name = "mono";
  camera.model = {240, 200, 250, 250, 119.5, 99.5};
  camera.bMc = make_transform_rpy({-0.2, 0.05, 0.1}, {0.1, 0.2, -1.5});
  info.cameras = {camera};
  info.calibration.arm = arm5e();
  info.calibration.ePl = Plane{Vector3d(1, 2, -0.5).normalized(), 0.098};
  info.calibration.laser_direction_e = Vector3d(0, 0.6, 0.8);
  info.calibration.laser_fan = 0.9;
  info.object = SessionObject{"box.obj", make_transform_rpy({0.3, -0.2, 0.9}, {3, 0, 0.6})};
  return info;
}

FrameRecord record_of(int i) {
  FrameRecord frame;
  frame.camera = "mono";
  frame.index = i;
  frame.sequence = static_cast<std::uint64_t>(i);
  frame.stamp = {1'000'000'000LL + i * 40'000'000LL};
  frame.phase = i < kDark ? Phase::kDarkBefore : i < kDark + kSweep ? Phase::kSweep : Phase::kDarkAfter;
  frame.laser_on = frame.phase == Phase::kSweep;
  frame.q = JointVector::Zero();
  *frame.q << 0, 0.12, 1.3 + i / 30.0, 0, 0.1;
  return frame;
}

/// A clock by which no line is late.
Stamp still() { return record_of(0).stamp; }

cv::Mat picture_of(int i) {
  GeneratedStripe g;
  g.noise = 3;
  g.seed = static_cast<unsigned>(i + 1);
  g.laser = record_of(i).laser_on;
  g.peak = i == kDark ? 300 : 150;
  g.row = [i](int x) { return 60 + 5.0 * i + (x > 120 ? 20 : 0); };
  return g.image();
}

/// A recording in progress beside its live reconstruction.
class Live : public testing::Test {
 protected:
  void begin(const LiveOptions& options = {}) {
    parameters_.laser_paper = PaperStripeParameters::simulation();
    parameters_.thresholds.surface_samples = 2000;
    writer_ = std::make_unique<SessionWriter>(folder_.path() / "s", info_of_scan());
    writer_->add_text("box.obj", kBox);
    live_ = std::make_unique<LiveReconstruction>(writer_->path(), parameters_, options);
  }
  void take(int i) {
    const cv::Mat image = picture_of(i);
    writer_->frame(record_of(i), image);
    live_->frame(record_of(i), image);
  }
  void take_all() {
    for (int i = 0; i < 2 * kDark + kSweep; ++i) take(i);
  }
  Session closed() {
    writer_->close("complete");
    return Session::open(writer_->path());
  }
  std::vector<Score> from_session(const Session& session) {
    const ObjectSurface object = object_of(session, parameters_.thresholds);
    return reconstruct_and_score(session, parameters_, object, kGoOn);
  }

  PipelineParameters parameters_;
  TemporaryFolder folder_;
  std::unique_ptr<SessionWriter> writer_;
  std::unique_ptr<LiveReconstruction> live_;
};

void expect_same(const PointCloud& a, const PointCloud& b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    ASSERT_EQ(a.points[i].p, b.points[i].p) << i;
    ASSERT_EQ(a.points[i].sigma, b.points[i].sigma) << i;
    ASSERT_EQ(a.points[i].frame, b.points[i].frame) << i;
  }
}

class LiveUnder : public Live, public testing::WithParamInterface<bool> {};

TEST_P(LiveUnder, AClockItGivesWhatTheSessionGivesToTheBit) {
  begin({.now = GetParam() ? still : nullptr, .waiting_frames = 100});
  take_all();
  live_->all_recorded();
  const Session session = closed();
  const ReadyReport report = live_->finish(session, kGoOn);
  const std::vector<Score>& ready = report.scores;
  const std::vector<Score> made = from_session(session);
  EXPECT_EQ(live_->trouble(), "");
  ASSERT_EQ(ready.size(), 2u);
  ASSERT_EQ(made.size(), 2u);
  for (std::size_t i = 0; i < ready.size(); ++i) {
    EXPECT_EQ(ready[i].method(), made[i].method());
    EXPECT_EQ(ready[i].json.dump(), made[i].json.dump());
    expect_same(ready[i].reconstruction.cloud, made[i].reconstruction.cloud);
    EXPECT_GT(made[i].reconstruction.rows.size(), 1000u);
    const Pictures drawn = draw_pictures(session, object_of(session, parameters_.thresholds), made[i]);
    EXPECT_GE(drawn.size(), 3u);
    for (const auto& [name, png] : drawn) EXPECT_TRUE(report.pictures.at(name) == png) << name;
  }
}
INSTANTIATE_TEST_SUITE_P(Clocks, LiveUnder, testing::Values(false, true),
                         [](const auto& clock) { return clock.param ? "OfTheWall" : "OfItsOwn"; });

TEST_F(Live, ShowsEachLineOfTheSweepAndCountsThem) {
  std::vector<LiveLine> lines;
  begin({.line = [&](const LiveLine& line) { lines.push_back(line); }});
  take_all();
  const Session session = closed();
  live_->finish(session, kGoOn);
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kSweep));
  std::uint64_t points = 0, found = 0;
  for (int i = 0; i < kSweep; ++i) {
    const LiveLine& line = lines[i];
    const FrameRecord& frame = session.frames[kDark + i];
    EXPECT_EQ(line.frame, frame.index);
    EXPECT_EQ(line.stamp, frame.stamp);
    EXPECT_EQ(line.columns, 240u);
    EXPECT_GT(line.found, 215u);
    const Plane sheet_b = session.camera(CameraRole::kMono).bMc * session.laser_plane(frame);
    for (const CloudPoint& point : line.points) ASSERT_NEAR(sheet_b.distance(point.p), 0, 1e-9);
    points += line.points.size();
    found += line.found;
  }
  EXPECT_GT(lines[0].clipped, 215u) << "its stripe is brighter than the camera can tell";
  EXPECT_LT(lines[1].clipped, 24u);
  const LiveFigures figures = live_->figures();
  EXPECT_EQ(figures.frames, static_cast<std::uint64_t>(kSweep));
  EXPECT_EQ(figures.lines, static_cast<std::uint64_t>(kSweep));
  EXPECT_EQ(figures.passed_over, 0u);
  EXPECT_EQ(figures.points, points);
  EXPECT_EQ(figures.found, found);
  EXPECT_THAT(in_words(figures), testing::HasSubstr("12 lines, "));
}

TEST_F(Live, PassesOverFramesInRealTimeRatherThanDelayTheRecorder) {
  std::promise<void> free;
  const std::shared_future<void> freed = free.get_future().share();
  std::vector<int> told;
  begin({.now = still, .waiting_frames = 4, .line = [&, freed](const LiveLine& line) {
           freed.wait();
           told.push_back(line.frame);
         }});
  take_all();  // and does not wait for a detector that stands still
  free.set_value();
  const Session session = closed();
  const std::vector<Score> ready = live_->finish(session, kGoOn).scores;
  const LiveFigures figures = live_->figures();
  EXPECT_GE(figures.passed_over, static_cast<std::uint64_t>(kSweep - 5));
  EXPECT_EQ(figures.frames, static_cast<std::uint64_t>(kSweep));
  ASSERT_GE(told.size(), 4u);
  constexpr int kEnd = kDark + kSweep;
  EXPECT_EQ(std::vector<int>(told.end() - 4, told.end()), (std::vector{kEnd - 4, kEnd - 3, kEnd - 2, kEnd - 1}));
  ASSERT_EQ(ready.size(), 2u) << "it has them all the same";
  EXPECT_EQ(ready[0].json.dump(), from_session(session)[0].json.dump());
}

struct SlowDetector {
  std::string name;
  std::vector<int> finding_ms;  ///< its looks; all further ones take as long as the last
  std::vector<int> told;        ///< of the sweep's frames, one each 40 ms
};
void PrintTo(const SlowDetector& detector, std::ostream* out) { *out << detector.name; }

class LiveWithADetector : public Live, public testing::WithParamInterface<SlowDetector> {};

/// It finds the first line as the second frame comes, and every look begins where the one before ended.
TEST_P(LiveWithADetector, TellsNoLineLate) {
  const SlowDetector& detector = GetParam();
  std::promise<void> all_taken;
  Stamp now = record_of(kDark).stamp;
  std::vector<int> told;
  int readings = -kDark;  // one at a dark frame, one before and one after a lit one
  const auto clock = [&] {
    if (++readings > 0 && readings % 2 == 0) {
      const std::size_t look = static_cast<std::size_t>(readings / 2 - 1);
      now = now + std::chrono::milliseconds{detector.finding_ms[std::min(look, detector.finding_ms.size() - 1)]};
    }
    return now;
  };
  begin({.now = clock, .waiting_frames = 100, .line = [&](const LiveLine& line) {
           if (told.empty()) all_taken.get_future().wait();
           EXPECT_LE(now - line.stamp, kLatestLine) << line.frame;
           told.push_back(line.frame - kDark);
         }});
  take_all();
  all_taken.set_value();
  const Session session = closed();
  const std::vector<Score> ready = live_->finish(session, kGoOn).scores;
  EXPECT_EQ(told, detector.told);
  EXPECT_EQ(live_->figures().passed_over + told.size(), static_cast<std::size_t>(kSweep));
  ASSERT_EQ(ready.size(), 2u) << "it has them all the same";
  EXPECT_EQ(ready[0].json.dump(), from_session(session)[0].json.dump());
}
INSTANTIATE_TEST_SUITE_P(, LiveWithADetector,
                         testing::Values(SlowDetector{"ABitTooSlow", {40, 60}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}},
                                         SlowDetector{"FourTimesTooSlow", {40, 160}, {0, 1, 2, 6, 10}},
                                         SlowDetector{"SlowerThanTheBound", {40, 500}, {0}},
                                         SlowDetector{"ThatStoodStillOnce", {40, 430, 40}, {0, 11}}),
                         [](const auto& detector) { return detector.param.name; });

TEST_F(Live, ThatBreaksHarmsNothingAndSaysWhy) {
  begin({.line = [](const LiveLine&) { throw std::runtime_error("no more memory"); }});
  take_all();
  const Session session = closed();
  EXPECT_EQ(session.frames.size(), static_cast<std::size_t>(2 * kDark + kSweep));
  EXPECT_TRUE(live_->finish(session, kGoOn).scores.empty());
  EXPECT_EQ(live_->trouble(), "no more memory");
  EXPECT_TRUE(live_->pictures().empty());
}

TEST_F(Live, IsNotBelievedWhereTheSessionHoldsOtherFrames) {
  begin();
  take_all();
  live_->frame(record_of(2 * kDark + kSweep), picture_of(0));  // which the disk refused
  EXPECT_TRUE(live_->finish(closed(), kGoOn).scores.empty());
  EXPECT_THAT(live_->trouble(), testing::HasSubstr("other frames"));
}

TEST_F(Live, KeepsNoPicturesThatFillTheMemory) {
  begin({.kept_bytes = 1'000'000});
  take_all();
  const Session session = closed();
  EXPECT_TRUE(live_->pictures().empty());
  EXPECT_TRUE(live_->finish(session, kGoOn).scores.empty());
  EXPECT_EQ(live_->figures().lines, static_cast<std::uint64_t>(kSweep)) << "it shows them all the same";
  EXPECT_EQ(live_->trouble(), "");
}

TEST_F(Live, PicturesStandInForFilesThatAreNotWrittenYet) {
  begin();
  take_all();
  writer_->close("complete", {.stop = [] { return true; }});
  const Session early = Session::open(writer_->path(), live_->pictures());
  EXPECT_TRUE(early.all_there);
  EXPECT_TRUE(early.warnings.empty());
  ASSERT_EQ(early.frames.size(), static_cast<std::size_t>(2 * kDark + kSweep));
  for (std::size_t i = 0; i < early.frames.size(); ++i)
    EXPECT_EQ(cv::norm(early.image(early.frames[i]), picture_of(static_cast<int>(i)), cv::NORM_INF), 0);
  EXPECT_FALSE(Session::open(writer_->path()).all_there);
}

TEST_F(Live, MayBeLeftAtAnyTime) {
  begin({.now = still});
  for (int i = 0; i < kDark + 2; ++i) take(i);
  live_.reset();
  closed();
}

}  // namespace
}  // namespace tankrig
