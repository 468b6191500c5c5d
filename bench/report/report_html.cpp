#include "bench/report/report_html.hpp"

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "bench/report/figures.hpp"
#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"

namespace tankrig {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #222; background: #fff; max-width: 1000px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; margin: 0 0 .3rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; width: 100%; } th, td { text-align: left; padding: .35rem .7rem; border-bottom: 1px solid #e2e2e2; vertical-align: top; }
thead th { border-bottom: 2px solid #888; } td.n { font-variant-numeric: tabular-nums; white-space: nowrap; }
.big td.n { font-size: 1.15rem; } small { color: #666; display: block; font-size: .78rem; white-space: normal; }
.warn { background: #fff4d6; border-left: 4px solid #e0a100; padding: .4rem .8rem; margin: .4rem 0; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 1rem; } h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
figure { margin: 0; break-inside: avoid; } img { max-width: 100%; border: 1px solid #ddd; } figcaption { color: #555; font-size: .9rem; }
pre { background: #f5f5f5; padding: .7rem; overflow-x: auto; font-size: .8rem; } code { background: #f5f5f5; padding: .1rem .3rem; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } details { display: none; } tr { break-inside: avoid; } }
)";

std::string cell(const std::string& figure, const std::string& beside) {
  return "<td class=\"n\">" + html_escaped(figure) +
         (beside.empty() ? "" : "<small>" + html_escaped(beside) + "</small>") + "</td>";
}

double number_or(const json& object, const char* key, double fallback) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : fallback;
}

json thresholds_of(const json& metrics) { return metrics.value("thresholds", json::object()); }

std::string limit(const json& thresholds, const char* key, const char* words) {
  const double metres = number_or(thresholds, key, -1);
  return metres < 0 ? "" : words + millimetres(metres);
}

/// The paper's four figures of every method, each with its threshold and what it could be at best.
std::string headline_table(const std::vector<ReportMethod>& methods) {
  std::string out =
      "<table class=\"big\"><thead><tr><th>method</th><th>mean error</th><th>standard deviation</th><th>coverage</th>"
      "<th>outliers</th><th>points</th></tr></thead><tbody>\n";
  for (const ReportMethod& method : methods) {
    const json& m = method.metrics;
    const json t = thresholds_of(m);
    std::string coverage = "ceiling " + shown_figure(m, "coverage_ceiling") + limit(t, "coverage_headline_m", "; at ");
    if (m.contains("coverage_of_ceiling") && m["coverage_of_ceiling"].is_number())
      coverage = shown_figure(m, "coverage_of_ceiling") + " of its " + coverage;
    std::string outliers = limit(t, "outlier_m", "beyond ");
    if (m.contains("outlier_count")) outliers = shown_figure(m, "outlier_count") + " points " + outliers;
    out += "<tr><th>" + html_escaped(method.name);
    if (m.contains("reason") && m["reason"].is_string())
      out += "<small>" + html_escaped(m["reason"].get<std::string>()) + "</small>";
    out += "</th>" + cell(shown_figure(m, "mean_error_m"), limit(t, "inlier_m", "of points within ")) +
           cell(shown_figure(m, "stddev_m"), limit(t, "inlier_m", "of points within ")) +
           cell(shown_figure(m, "coverage"), coverage) + cell(shown_figure(m, "outliers"), outliers) +
           cell(shown_figure(m, "points"), shown_figure(m, "rejected") + " not on the object") + "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

/// Every scalar figure any method has, a row each.
std::string all_figures_table(const std::vector<ReportMethod>& methods) {
  std::vector<std::string> keys;
  for (const ReportMethod& method : methods)
    for (const auto& [key, value] : method.metrics.items())
      if ((value.is_number() || value.is_null()) && std::find(keys.begin(), keys.end(), key) == keys.end())
        keys.push_back(key);
  std::string out = "<table><thead><tr><th>figure</th>";
  for (const ReportMethod& method : methods) out += "<th>" + html_escaped(method.name) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const std::string& key : keys) {
    out += "<tr><td>" + html_escaped(figure_name(key)) + "</td>";
    for (const ReportMethod& method : methods) out += cell(shown_figure(method.metrics, key), "");
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

/// Coverage at each tolerance: of the whole surface, and of the ceiling.
std::string coverage_table(const std::vector<ReportMethod>& methods) {
  std::vector<std::string> tolerances;
  for (const ReportMethod& method : methods) {
    const json at = method.metrics.value("coverage_at", json::object());
    for (const auto& [tolerance, share] : at.items())
      if (std::find(tolerances.begin(), tolerances.end(), tolerance) == tolerances.end())
        tolerances.push_back(tolerance);
  }
  if (tolerances.empty()) return "";
  std::string out = "<h2>Coverage by tolerance</h2>\n<table><thead><tr><th>method</th>";
  for (const std::string& tolerance : tolerances)
    out += "<th>" + html_escaped(millimetres(std::strtod(tolerance.c_str(), nullptr))) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const ReportMethod& method : methods) {
    const json at = method.metrics.value("coverage_at", json::object()),
               of = method.metrics.value("coverage_of_ceiling_at", json::object());
    out += "<tr><th>" + html_escaped(method.name) + "</th>";
    for (const std::string& tolerance : tolerances) {
      const double share = number_or(at, tolerance.c_str(), -1), part = number_or(of, tolerance.c_str(), -1);
      out += cell(share < 0 ? "none" : percent(share), part < 0 ? "" : percent(part) + " of its ceiling");
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

std::string thresholds_table(const std::vector<ReportMethod>& methods) {
  std::vector<std::pair<std::string, std::vector<std::string>>> rows;
  for (const ReportMethod& method : methods) {
    const json thresholds = thresholds_of(method.metrics);
    for (const auto& [key, value] : thresholds.items()) {
      const std::string name = figure_name(key);
      auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return r.first == name; });
      if (row == rows.end()) row = rows.insert(rows.end(), {name, {}});
      const std::string text = shown_figure(thresholds, key);
      if (std::find(row->second.begin(), row->second.end(), text) == row->second.end()) row->second.push_back(text);
    }
  }
  if (rows.empty()) return "";
  std::string out = "<h2>Thresholds</h2>\n<table><tbody>\n";
  for (const auto& [key, values] : rows) {
    out += "<tr><td>" + html_escaped(key) + "</td><td class=\"n\">";
    for (std::size_t i = 0; i < values.size(); ++i) out += (i ? " / " : "") + html_escaped(values[i]);
    out += "</td></tr>\n";
  }
  return out + "</tbody></table>\n";
}

std::string picture_data(const ReportPicture& picture) {
  if (!picture.image.empty()) {
    std::vector<unsigned char> bytes;
    bool encoded = false;
    try {
      encoded = cv::imencode(".png", picture.image, bytes);
    } catch (const cv::Exception&) {
    }
    if (!encoded)
      throw InputError("report: picture '" + picture.caption +
                       "' cannot be encoded, expected 8 bits and 1 or 3 channels");
    return "data:image/png;base64," + base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  const std::string data = read_regular_file(picture.file, kMostPictureBytes, "a PNG or JPEG picture");
  if (data.starts_with("\x89PNG")) return "data:image/png;base64," + base64(data);
  if (data.starts_with("\xff\xd8")) return "data:image/jpeg;base64," + base64(data);
  throw InputError(picture.file, "cannot be read, expected a PNG or JPEG picture");
}

std::string pictures_in_groups(const std::vector<ReportPicture>& pictures) {
  std::string out = pictures.empty() ? "" : "<h2>Pictures</h2>\n";
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const ReportPicture& picture = pictures[i];
    if (i == 0 || picture.heading != pictures[i - 1].heading)
      out += std::string(i == 0 ? "" : "</div>\n") +
             (picture.heading.empty() ? "" : "<h3>" + html_escaped(picture.heading) + "</h3>\n") +
             "<div class=\"pictures\">\n";
    out += "<figure><img alt=\"" + html_escaped(picture.caption) + "\" src=\"" + picture_data(picture) +
           "\"><figcaption>" + html_escaped(picture.caption) + "</figcaption></figure>\n";
  }
  return out + (pictures.empty() ? "" : "</div>\n");
}

std::string files_list(const std::vector<ReportMethod>& methods) {
  std::string out;
  for (const ReportMethod& method : methods) {
    if (method.files.empty()) continue;
    out += "<tr><th>" + html_escaped(method.name) + "</th><td>";
    for (const std::string& file : method.files)
      out += "<a href=\"" + html_escaped(file) + "\">" + html_escaped(file) + "</a> ";
    out += "</td></tr>\n";
  }
  return out.empty() ? "" : "<h2>Clouds and figures as files</h2>\n<table><tbody>\n" + out + "</tbody></table>\n";
}

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= left ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string report_html(const ReportData& data) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">"
      "<title>" +
      html_escaped(data.title) + "</title><style>" + kStyle + "</style></head><body>\n<h1>" + html_escaped(data.title) +
      "</h1>\n";
  for (const std::string& warning : data.warnings) out += "<p class=\"warn\">" + html_escaped(warning) + "</p>\n";
  if (!data.methods.empty()) out += "<h2>The four figures</h2>\n" + headline_table(data.methods);
  out += files_list(data.methods) + pictures_in_groups(data.pictures);
  if (!data.methods.empty()) {
    out += coverage_table(data.methods) + "<h2>All figures</h2>\n" + all_figures_table(data.methods) +
           thresholds_table(data.methods);
  }
  if (!data.facts.empty()) {
    out += "<h2>Session</h2>\n<table><tbody>\n";
    for (const auto& [what, value] : data.facts)
      out += "<tr><td>" + html_escaped(what) + "</td><td>" + html_escaped(value) + "</td></tr>\n";
    out += "</tbody></table>\n";
  }
  if (!data.command.empty()) out += "<p>Made by <code>" + html_escaped(data.command) + "</code></p>\n";
  for (const ReportMethod& method : data.methods)
    out += "<details><summary>" + html_escaped(method.name) + ", as written to the results</summary><pre>" +
           html_escaped(method.metrics.dump(2)) + "</pre></details>\n";
  return out + "</body></html>\n";
}

void write_report_html(const fs::path& file, const ReportData& data) { write_file_durably(file, report_html(data)); }

}  // namespace tankrig
