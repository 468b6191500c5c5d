#include "apps/tankrig/results/summary.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace tankrig::app {
namespace {

/// `value * factor` in a format of fmt, or a dash for null.
std::string cell(const nlohmann::json& value, double factor, const char* format) {
  return value.is_number() ? fmt::format(fmt::runtime(format), value.get<double>() * factor) : "-";
}

template <class... Texts>
std::string row(const Texts&... texts) {
  return fmt::format("{:<13} {:>9} {:>9} {:>9} {:>9} {:>10} {:>11} {:>9}\n", texts...);
}

}  // namespace

std::string score_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores) {
  using S = std::string;
  S table = row("method", "points", "mean", "stddev", "coverage", "ceiling", "of ceiling", "outliers");
  S reasons;
  for (const auto& [name, score] : scores) {
    table += row(name, score.at("points").get<std::size_t>(), cell(score.at("mean_error_m"), 1e3, "{:.2f} mm"),
                 cell(score.at("stddev_m"), 1e3, "{:.2f} mm"), cell(score.at("coverage"), 100, "{:.1f} %"),
                 cell(score.at("coverage_ceiling"), 100, "{:.1f} %"),
                 cell(score.at("coverage_of_ceiling"), 100, "{:.1f} %"), cell(score.at("outliers"), 100, "{:.2f} %"));
    if (score.contains("reason")) reasons += name + ": " + score["reason"].get<S>() + "\n";
  }
  if (!scores.empty()) {
    const nlohmann::json& t = scores.front().second.at("thresholds");
    table += "thresholds: inlier " + cell(t.at("inlier_m"), 1e3, "{:g} mm") + ", outlier " +
             cell(t.at("outlier_m"), 1e3, "{:g} mm") + ", coverage " +
             cell(t.at("coverage_headline_m"), 1e3, "{:g} mm") +
             "; coverage is of the whole surface, the ceiling what could be seen\n";
  }
  return table + reasons;
}

std::string coverage_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores) {
  if (scores.empty()) return {};
  std::string head = fmt::format("{:<13}", "coverage at"), rows;
  for (const auto& [threshold, share] : scores.front().second.at("coverage_at").items())
    head += fmt::format(" {:>9}", fmt::format("{:g} mm", 1e3 * std::strtod(threshold.c_str(), nullptr)));
  for (const auto& [name, score] : scores) {
    rows += fmt::format("{:<13}", name);
    for (const auto& [threshold, share] : score.at("coverage_at").items())
      rows += fmt::format(" {:>9}", cell(share, 100, "{:.1f} %"));
    rows += "\n";
  }
  return head + "\n" + rows;
}

void warn_of(const std::vector<Score>& scores, Progress& progress) {
  for (const Score& score : scores)
    if (!score.reconstruction.warning.empty()) progress.warn(score.reconstruction.warning);
}

std::string registration_line(const nlohmann::json& r) {
  const nlohmann::json& t = r.at("translation_m");
  return fmt::format("moved by ({}, {}, {}) mm, turned by {} deg; {} pairs ({} %), rms {}", cell(t[0], 1e3, "{:.2f}"),
                     cell(t[1], 1e3, "{:.2f}"), cell(t[2], 1e3, "{:.2f}"), cell(r.at("rotation_deg"), 1, "{:.3f}"),
                     r.at("pairs").dump(), cell(r.at("share"), 100, "{:.0f}"), cell(r.at("rms_m"), 1e3, "{:.2f} mm"));
}

std::string aligned_table(const nlohmann::json& score) {
  if (!score.contains("aligned")) return score_table({{"cloud", score}});
  const nlohmann::json& aligned = score.at("aligned");
  if (aligned.contains("refused"))
    return score_table({{"cloud", score}}) + "not aligned: " + aligned.at("refused").get<std::string>() + "\n";
  return score_table({{"cloud", score}, {"cloud aligned", aligned}}) +
         "aligned: " + registration_line(aligned.at("transform")) + "\n";
}

std::string sync_line(const Statistics& sync) {
  std::string ms, mm, sigma;
  for (const Statistic& s : sync) {
    const bool residual = s.name.starts_with("sync.residual_");
    if (!residual && !s.name.starts_with("sync.stamp_sigma_")) continue;
    std::string& list = !residual ? sigma : s.name.ends_with("_ms") ? ms : mm;
    list += fmt::format("{}{:.2f}", list.empty() ? "" : ", ", s.value);
  }
  return "sync residual (median, 99 %, most): " + ms + " ms; " + mm + " mm on the target; sigma of the stamps " +
         sigma + " ms\n";
}

std::string uwsim_table(const nlohmann::json& score) {
  std::string table;
  for (const auto& [name, value] : score.items()) {
    table += fmt::format("{:<20}  {}\n", name, value.dump());
  }
  return table;
}

}  // namespace tankrig::app
