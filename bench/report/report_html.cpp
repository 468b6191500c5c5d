#include "bench/report/report_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mstch/mstch.hpp>

#include "bench/report/cloud_view.hpp"
#include "bench/report/figures.hpp"
#include "bench/report/picture_uri.hpp"
#include "bench/report/web_programs.hpp"
#include "core/atomic_file.hpp"

namespace tankrig {

extern const char* const kReportTemplate;  ///< report.html.mustache, compiled in

namespace {

using mstch::array;
using mstch::map;
using nlohmann::json;
namespace fs = std::filesystem;

double number_or(const json& object, const std::string& key, double fallback) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : fallback;
}

std::string text_or_none(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

std::string figure_if_any(const json& object, const char* key) {
  return number_or(object, key, -1) < 0 ? "" : shown_figure(object, key);
}

std::string threshold(const json& metrics, const char* key) {
  const double metres = number_or(metrics.value("thresholds", json::object()), key, -1);
  return metres < 0 ? "" : millimetres(metres);
}

void add_once(std::vector<std::string>& list, const std::string& text) {
  if (std::find(list.begin(), list.end(), text) == list.end()) list.push_back(text);
}

array array_of(const std::vector<std::string>& texts) { return array(texts.begin(), texts.end()); }

/// What the template shows under one heading; nothing, heading included, where there are no rows.
mstch::node section(const char* rows_name, array rows, map others = {}) {
  if (rows.empty()) return nullptr;
  others[rows_name] = std::move(rows);
  return others;
}

/// The paper's four figures, each with its threshold and what it could be at best.
array method_nodes(const std::vector<ReportMethod>& methods) {
  array nodes;
  for (const ReportMethod& method : methods) {
    const json& m = method.metrics;
    nodes.push_back(map{{"name", method.name},
                        {"reason", text_or_none(m, "reason")},
                        {"warning", text_or_none(m, "warning")},
                        {"mean_error", shown_figure(m, "mean_error_m")},
                        {"stddev", shown_figure(m, "stddev_m")},
                        {"coverage", shown_figure(m, "coverage")},
                        {"of_ceiling", figure_if_any(m, "coverage_of_ceiling")},
                        {"ceiling", shown_figure(m, "coverage_ceiling")},
                        {"outliers", shown_figure(m, "outliers")},
                        {"outlier_count", figure_if_any(m, "outlier_count")},
                        {"points", shown_figure(m, "points")},
                        {"rejected", shown_figure(m, "rejected")},
                        {"inlier", threshold(m, "inlier_m")},
                        {"outlier", threshold(m, "outlier_m")},
                        {"coverage_within", threshold(m, "coverage_headline_m")},
                        {"results", m.dump(2)}});
  }
  return nodes;
}

/// Every scalar figure any method has, a row each.
array figure_rows(const std::vector<ReportMethod>& methods) {
  std::vector<std::string> keys;
  for (const ReportMethod& method : methods)
    for (const auto& [key, value] : method.metrics.items())
      if (value.is_number() || value.is_null()) add_once(keys, key);
  array rows;
  for (const std::string& key : keys) {
    array values;
    for (const ReportMethod& method : methods) values.push_back(shown_figure(method.metrics, key));
    rows.push_back(map{{"name", figure_name(key)}, {"values", values}});
  }
  return rows;
}

/// Coverage at each tolerance: of the whole surface, and of the ceiling.
mstch::node coverage_by_tolerance(const std::vector<ReportMethod>& methods) {
  std::vector<std::string> tolerances;
  for (const ReportMethod& method : methods) {
    const json at = method.metrics.value("coverage_at", json::object());
    for (const auto& [tolerance, share] : at.items()) add_once(tolerances, tolerance);
  }
  if (tolerances.empty()) return nullptr;
  array columns, rows;
  for (const std::string& tolerance : tolerances)
    columns.push_back(millimetres(std::strtod(tolerance.c_str(), nullptr)));
  for (const ReportMethod& method : methods) {
    const json at = method.metrics.value("coverage_at", json::object()),
               of = method.metrics.value("coverage_of_ceiling_at", json::object());
    array cells;
    for (const std::string& tolerance : tolerances) {
      const double share = number_or(at, tolerance, -1), part = number_or(of, tolerance, -1);
      cells.push_back(
          map{{"share", share < 0 ? "none" : percent(share)}, {"of_ceiling", part < 0 ? "" : percent(part)}});
    }
    rows.push_back(map{{"name", method.name}, {"cells", cells}});
  }
  return section("rows", rows, {{"columns", columns}});
}

array threshold_rows(const std::vector<ReportMethod>& methods) {
  std::vector<std::string> names;
  std::map<std::string, std::vector<std::string>> values;
  for (const ReportMethod& method : methods) {
    const json thresholds = method.metrics.value("thresholds", json::object());
    for (const auto& [key, value] : thresholds.items()) {
      add_once(names, figure_name(key));
      add_once(values[figure_name(key)], shown_figure(thresholds, key));
    }
  }
  array rows;
  for (const std::string& name : names)
    rows.push_back(map{{"name", name}, {"values", fmt::format("{}", fmt::join(values[name], " / "))}});
  return rows;
}

map picture_node(const ReportPicture& picture) {
  return {{"caption", picture.caption}, {"uri", picture_uri(picture.file)}};
}

array picture_groups(const std::vector<ReportPicture>& pictures) {
  array groups;
  for (auto begin = pictures.begin(); begin != pictures.end();) {
    const auto end = std::find_if(begin, pictures.end(), [&](const auto& p) { return p.heading != begin->heading; });
    array nodes;
    std::transform(begin, end, std::back_inserter(nodes), picture_node);
    groups.push_back(map{{"heading", begin->heading}, {"pictures", nodes}});
    begin = end;
  }
  return groups;
}

array file_rows(const std::vector<ReportMethod>& methods) {
  array rows;
  for (const ReportMethod& method : methods)
    if (!method.files.empty()) rows.push_back(map{{"name", method.name}, {"files", array_of(method.files)}});
  return rows;
}

mstch::node cloud_view_node(const std::string& data) {
  if (data.empty() || cloud_view_program().empty()) return nullptr;
  return map{{"data", data}, {"program", cloud_view_program()}};
}

array fact_rows(const ReportData& data) {
  array rows;
  for (const auto& [what, value] : data.facts) rows.push_back(map{{"what", what}, {"value", value}});
  return rows;
}

}  // namespace

std::string report_html(const ReportData& data) {
  return mstch::render(kReportTemplate,
                       map{{"title", data.title},
                           {"warnings", array_of(data.warnings)},
                           {"scored", !data.methods.empty()},
                           {"methods", method_nodes(data.methods)},
                           {"figures", figure_rows(data.methods)},
                           {"files", section("rows", file_rows(data.methods))},
                           {"cloud_view", cloud_view_node(data.cloud_view)},
                           {"pictures", section("groups", picture_groups(data.pictures))},
                           {"tolerances", coverage_by_tolerance(data.methods)},
                           {"thresholds", section("rows", threshold_rows(data.methods))},
                           {"session", section("facts", fact_rows(data))},
                           {"command", data.command}},
                       {{"links", std::string(kLinksTemplate)}, {"view", std::string(kViewTemplate)}});
}

void write_report_html(const fs::path& file, const ReportData& data) { write_file_durably(file, report_html(data)); }

}  // namespace tankrig
