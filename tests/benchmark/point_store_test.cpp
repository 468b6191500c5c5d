// A sweep's rows on disk: added in any order, cut, merged, and read back in theirs.
#include "bench/benchmark/point_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "bench/benchmark/result_tables.hpp"
#include "bench/sweep/point_views.hpp"
#include "bench/sweep/sweep_values.hpp"
#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using nlohmann::ordered_json;
using ::testing::ElementsAre;

const ordered_json kRun{{"benchmark_sha256", "0123"}, {"seed", 1}};

ordered_json row_of(double value) { return {{"values", {value}}, {"simulated_s", 10 * value}}; }

std::vector<std::pair<std::size_t, double>> all(const PointRows& rows) {
  std::vector<std::pair<std::size_t, double>> out;
  rows.for_each([&](std::size_t point, const ordered_json& row) {
    EXPECT_FALSE(row.contains("point"));
    out.emplace_back(point, row["simulated_s"]);
  });
  return out;
}

/// The loops of light 0, 1 ... 5.
Benchmark six_lights() {
  Benchmark benchmark;
  Updater light;
  light.kind = UpdaterKind::kLight;
  light.last = 5;
  benchmark.updaters.push_back(light);
  return benchmark;
}

TEST(PointStore, GivesItsRowsInTheirOrderTheLaterOfTwo) {
  const TemporaryFolder folder;
  {
    PointStore store(folder.path(), kRun);
    for (const int point : {3, 0, 3}) store.add(static_cast<std::size_t>(point), row_of(point + 0.5));
    store.add(0, row_of(7));
    EXPECT_EQ(store.rows().row(0)["simulated_s"], 70);
    EXPECT_EQ(store.bytes(), std::filesystem::file_size(folder.path() / "points.jsonl"));
  }
  const PointRows rows(folder.path());
  EXPECT_EQ(rows.run(), kRun);
  EXPECT_THAT(all(rows), ElementsAre(std::pair(0, 70.0), std::pair(3, 35.0)));
}

TEST(PointStore, CutsAnUnfinishedLineAndGoesOnBehindTheLastWholeOne) {
  const TemporaryFolder folder;
  { PointStore(folder.path(), kRun).add(1, row_of(1)); }
  std::ofstream(folder.path() / "points.jsonl", std::ios::app) << R"({"point":2,"values":[)";
  {
    PointStore store(folder.path(), kRun);
    EXPECT_EQ(store.reused(), 1u);
    store.add(2, row_of(2));
  }
  EXPECT_THAT(all(PointRows(folder.path())), ElementsAre(std::pair(1, 10.0), std::pair(2, 20.0)));
}

TEST(PointStore, RefusesALineThatIsNoRow) {
  for (const char* line :
       {R"({"values":[1]})", R"({"point":1})", R"({"point":-1,"values":[1]})", R"([{"point":1,"values":[1]}])",
        R"({"a":{"point":1,"values":[1]}})", R"({"point":1,"values":[1})", "", "7"}) {
    const TemporaryFolder folder;
    folder.write("points.jsonl", kRun.dump() + "\n" + line + "\n");
    EXPECT_THROW(PointRows(folder.path()), InputError) << line;
  }
  const TemporaryFolder folder;
  folder.write("points.jsonl", R"({"seed":1})" + std::string("\n"));
  EXPECT_THROW(PointRows(folder.path()), InputError);
}

TEST(PointStore, TakesFromAnotherWhatItLacks) {
  const TemporaryFolder one, other;
  { PointStore(one.path(), kRun).add(1, row_of(1)); }
  {
    PointStore store(other.path(), kRun);
    for (const int point : {2, 1, 0}) store.add(static_cast<std::size_t>(point), row_of(point + 5));
  }
  {
    PointStore store(one.path(), kRun);
    store.add(PointRows(other.path()));
  }
  EXPECT_THAT(all(PointRows(one.path())), ElementsAre(std::pair(0, 50.0), std::pair(1, 10.0), std::pair(2, 70.0)));
}

TEST(ResultTables, AreOneDocumentAndOneTableInPlaceAtTheEnd) {
  const TemporaryFolder folder;
  const Benchmark benchmark = six_lights();
  {
    ResultTables unfinished(folder.path(), benchmark, kRun);
    unfinished.add(0, row_of(0));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  ResultTables tables(folder.path(), benchmark, kRun);
  for (const int point : {0, 5}) tables.add(static_cast<std::size_t>(point), row_of(point));
  EXPECT_THROW(tables.add(4, row_of(3)), InputError);
  EXPECT_THROW(tables.add(6, row_of(6)), InputError);
  tables.finish();
  const auto document = ordered_json::parse(folder.read("results.json"));
  EXPECT_EQ(document["run"], kRun);
  ASSERT_EQ(document["points"].size(), 2u);
  EXPECT_EQ(document["points"][1]["point"], 5);
  EXPECT_EQ(folder.read("results.csv"), "point,Light,SimTime [s],error\n0,0,0,\n5,5,50,\n");
}

TEST(PointViews, ComeBackWithoutWhatWasCut) {
  const TemporaryFolder folder;
  EXPECT_TRUE(read_views(folder.path()).empty());
  add_views(folder.path(), 4, {{"mono", "", "AAAA"}});
  std::ofstream(folder.path() / "views.jsonl", std::ios::app) << R"({"point":5,"views":[{"capt)";
  add_views(folder.path(), 6, {{"laser", "laser", "BBBB"}});
  const PointViews views = read_views(folder.path());
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views.at(4)[0].jpeg, "AAAA");
  EXPECT_EQ(views.at(6)[0].measure, "laser");
  add_views(folder.path(), 7, {{"mono", "", "\"><script>"}});
  EXPECT_THROW(read_views(folder.path()), InputError);
}

TEST(PointViews, AreOfOneConfigurationForADotAndOfAtMost256) {
  Benchmark benchmark = six_lights();
  Updater repeat, noise;
  repeat.kind = UpdaterKind::kRepeat, repeat.last = 2;
  noise.kind = UpdaterKind::kNoise, noise.last = 9;
  benchmark.updaters = {noise, repeat, benchmark.updaters[0]};
  std::size_t viewed = 0;
  for (std::size_t point = 0; point < benchmark.points(); ++point) {
    const std::vector<double> values = benchmark.values(point),
                              shown = benchmark.values(standing_for(benchmark, point));
    EXPECT_EQ(shown, (std::vector<double>{values[0], 0, values[2]}));
    viewed += is_viewed(benchmark, point);
  }
  EXPECT_EQ(viewed, 60u);
  benchmark.updaters[0].last = 99;
  viewed = 0;
  for (std::size_t point = 0; point < benchmark.points(); ++point) viewed += is_viewed(benchmark, point);
  EXPECT_EQ(viewed, 200u);  // every third of 600
}

}  // namespace
}  // namespace tankrig
