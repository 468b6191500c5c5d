#include "apps/tankrig/summary.hpp"

#include <cstdio>

namespace tankrig::app {
namespace {

/// `value * factor` in a printf format, or a dash for null.
std::string cell(const nlohmann::json& value, double factor, const char* format) {
  if (!value.is_number()) return "-";
  char text[48];
  std::snprintf(text, sizeof text, format, value.get<double>() * factor);
  return text;
}

template <class... Texts>
std::string row(const char* format, const Texts&... texts) {
  char line[200];
  std::snprintf(line, sizeof line, format, texts.c_str()...);
  std::string text(line);
  text += '\n';
  return text;
}

}  // namespace

std::string score_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores) {
  using S = std::string;
  const char* format = "%-13s %9s %9s %9s %9s %10s %11s %9s";
  S table = row(format, S("method"), S("points"), S("mean"), S("stddev"), S("coverage"), S("ceiling"), S("of ceiling"),
                S("outliers"));
  S reasons;
  for (const auto& [name, score] : scores) {
    table += row(format, name, std::to_string(score.at("points").get<std::size_t>()),
                 cell(score.at("mean_error_m"), 1e3, "%.2f mm"), cell(score.at("stddev_m"), 1e3, "%.2f mm"),
                 cell(score.at("coverage"), 100, "%.1f %%"), cell(score.at("coverage_ceiling"), 100, "%.1f %%"),
                 cell(score.at("coverage_of_ceiling"), 100, "%.1f %%"), cell(score.at("outliers"), 100, "%.2f %%"));
    if (score.contains("reason")) reasons += name + ": " + score["reason"].get<S>() + "\n";
  }
  if (!scores.empty()) {
    const nlohmann::json& t = scores.front().second.at("thresholds");
    table += "thresholds: inlier " + cell(t.at("inlier_m"), 1e3, "%g mm") + ", outlier " +
             cell(t.at("outlier_m"), 1e3, "%g mm") + ", coverage " + cell(t.at("coverage_headline_m"), 1e3, "%g mm") +
             "; coverage is of the whole surface, the ceiling what could be seen\n";
  }
  return table + reasons;
}

std::string registration_line(const nlohmann::json& r) {
  const nlohmann::json& t = r.at("translation_m");
  return "moved by (" + cell(t[0], 1e3, "%.2f") + ", " + cell(t[1], 1e3, "%.2f") + ", " + cell(t[2], 1e3, "%.2f") +
         ") mm, turned by " + cell(r.at("rotation_deg"), 1, "%.3f") + " deg; " + r.at("pairs").dump() + " pairs (" +
         cell(r.at("share"), 100, "%.0f") + " %), rms " + cell(r.at("rms_m"), 1e3, "%.2f mm");
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
    char number[32];
    std::snprintf(number, sizeof number, "%s%.2f", list.empty() ? "" : ", ", s.value);
    list += number;
  }
  return "sync residual (median, 99 %, most): " + ms + " ms; " + mm + " mm on the target; sigma of the stamps " +
         sigma + " ms\n";
}

std::string uwsim_table(const nlohmann::json& score) {
  std::string table;
  for (const auto& [name, value] : score.items()) {
    std::string row = name;
    row.resize(std::max<std::size_t>(row.size() + 2, 22), ' ');
    table += row + value.dump() + "\n";
  }
  return table;
}

}  // namespace tankrig::app
