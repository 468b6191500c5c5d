#include "apps/tankrig/bench/bench_results.hpp"

#include <algorithm>
#include <cstdio>

#include "apps/tankrig/command_line/output.hpp"
#include "bench/benchmark/result_tables.hpp"
#include "bench/sweep/point_views.hpp"
#include "bench/sweep/sweep_html.hpp"
#include "bench/sweep/sweep_report.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig::app {
namespace {

constexpr const char* kBenchmark = "benchmark.xml";

/// Pictures that need the rig to be made again, in the order of the page.
std::vector<std::string> pictures_there(const fs::path& folder, const Benchmark& benchmark) {
  std::vector<std::string> names{kViewsLight, kViewsNoise, kViewsFog, kViewsOutside, kViewsCamera, kCloudGrid};
  for (const Measure& measure : benchmark.measures) names.push_back("cloud_" + measure.name + ".png");
  std::erase_if(names, [&](const std::string& name) { return !fs::exists(folder / "figures" / name); });
  return names;
}

}  // namespace

void keep_benchmark(const fs::path& folder, const fs::path& file) {
  write_whole_file(folder / kBenchmark, read_whole_file(file));
}

std::size_t write_results(const fs::path& folder, const Benchmark& benchmark, const PointRows& rows) {
  ResultTables tables(folder, benchmark, rows.run());
  SweepRows swept(benchmark, rows.size());
  rows.for_each([&](std::size_t point, const ordered_json& row) {
    tables.add(point, row);
    swept.add(point, row);
  });
  tables.finish();
  std::vector<std::string> figures = write_sweep_figures(folder, benchmark, swept);
  for (std::string& picture : pictures_there(folder, benchmark)) figures.push_back(std::move(picture));
  write_whole_file(folder / "results.md", sweep_page(benchmark, rows.run(), swept, figures));
  write_file_durably(folder / "report.html", sweep_html(folder, benchmark, rows.run(), swept));
  return swept.failed();
}

void take_pictures(const fs::path& folder, const fs::path& other, const Benchmark& benchmark) {
  fs::create_directories(folder / "figures");
  for (const std::string& name : pictures_there(other, benchmark))
    copy_whole_file(other / "figures" / name, folder / "figures" / name);
  if (fs::exists(other / "figures" / kCloudView))
    copy_whole_file(other / "figures" / kCloudView, folder / "figures" / kCloudView);
  const PointViews its = read_views(other);
  const PointViews known = its.empty() ? PointViews() : read_views(folder);
  for (const auto& [point, views] : its)
    if (!known.contains(point)) add_views(folder, point, views);
}

bool holds_benchmark(const fs::path& folder) { return fs::exists(folder / "points.jsonl"); }

int report_benchmark(const fs::path& folder, bool json) {
  const PointRows rows(folder);
  const ordered_json& run = rows.run();
  const fs::path file = folder / kBenchmark;
  if (run.value("benchmark_sha256", "") != sha256_of_text(read_whole_file(file)))
    throw InputError(file, "is not the benchmark that was run, expected the file with the SHA-256 " +
                               run.value("benchmark_sha256", "none"));
  Benchmark benchmark = read_benchmark(file);
  drop_loops_left_out(benchmark, run);
  benchmark.file = fs::path(run.value("benchmark", kBenchmark)).filename();
  const std::size_t failed = write_results(folder, benchmark, rows);
  const std::size_t missing = benchmark.points() - std::min(benchmark.points(), rows.size());
  if (json)
    print_json({{"folder", folder.string()}, {"points", rows.size()}, {"missing", missing}, {"failed", failed}});
  else
    std::printf("%zu configurations of %zu, %zu failed: look at %s\n", rows.size(), benchmark.points(), failed,
                printable((folder / "report.html").string()).c_str());
  return missing > 0 || failed > 0 ? kPartial : kOk;
}

}  // namespace tankrig::app
