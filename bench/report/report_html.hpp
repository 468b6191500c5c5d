// One page that says how good a scan was: figures with what limits them, and the pictures.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace tankrig {

struct ReportPicture {
  std::string heading;  ///< what it is of, e.g. a method; pictures with one heading stand together
  std::string caption;
  std::filesystem::path file;  ///< PNG or JPEG; the page holds its bytes
};

/// One method's score: bench/metrics' to_json(Metrics). A text member "reason" says why there is no cloud,
/// "warning" why it may say little.
struct ReportMethod {
  std::string name;
  nlohmann::json metrics;
  std::vector<std::string> files;  ///< its clouds and figures, relative to the page
};

struct ReportData {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< of the session: what, value with its unit
  std::vector<ReportMethod> methods;                       ///< in table order
  std::string cloud_view;                                  ///< cloud_view_json(); empty: no 3D view
  std::vector<ReportPicture> pictures;
  std::vector<std::string> warnings;
  std::string command;  ///< what makes this page again
};

/// A self-contained page: nothing is loaded from anywhere; links lead to the files beside it. All text is escaped.
/// Errors: InputError naming a picture that cannot be read.
std::string report_html(const ReportData& data);

/// report_html() to `file`, whole or not at all.
/// Errors: InputError.
void write_report_html(const std::filesystem::path& file, const ReportData& data);

}  // namespace tankrig
