#include "apps/tankrig/bench/live_plots.hpp"

#include <algorithm>

#include "apps/tankrig/command_line/feed.hpp"
#include "bench/sweep/sweep_report.hpp"

namespace tankrig::app {

namespace {

constexpr std::chrono::seconds kPause{2};

bool is_empty(const Chart& chart) {
  return std::ranges::all_of(chart.panels, [](const ChartPanel& panel) {
    return std::ranges::all_of(panel.curves, [](const ChartCurve& curve) { return curve.points.empty(); });
  });
}

}  // namespace

void LivePlots::tell(const PointRows& rows, bool last) {
  const auto began = std::chrono::steady_clock::now();
  if (!Feed::one().heard() || rows.size() == 0 || (!last && began < next_)) return;
  SweepRows swept(benchmark_, rows.size());
  rows.for_each([&](std::size_t point, const nlohmann::ordered_json& row) { swept.add(point, row); });
  for (const ShownFigure& figure : shown_figures()) {
    const Chart chart = sweep_chart(benchmark_, swept, figure.detail);
    if (!is_empty(chart))
      Feed::one().tell({{"feed", "plot"}, {"plot", figure.detail}, {"title", figure.label}, {"svg", chart_svg(chart)}});
  }
  const auto ended = std::chrono::steady_clock::now();
  next_ = ended + std::max<std::chrono::steady_clock::duration>(kPause, 19 * (ended - began));
}

}  // namespace tankrig::app
