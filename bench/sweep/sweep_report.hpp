// What a sweep found, for people: curves over light for every noise in the form of the paper's Figures 8 and 9, tables over
// the grid, and the paper's own words beside them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/sweep/chart.hpp"
#include "bench/sweep/sweep_rows.hpp"

namespace tankrig {

// Pictures in figures/ that need the rig, or its sessions, to be made again.
inline constexpr const char* kViewsLight = "views_light.png";
inline constexpr const char* kViewsNoise = "views_noise.png";
inline constexpr const char* kViewsFog = "views_fog.png";
inline constexpr const char* kViewsOutside = "views_outside.png";  ///< of an experiment, as what follows
inline constexpr const char* kViewsCamera = "views_camera.png";
inline constexpr const char* kCloudGrid = "clouds.png";
inline constexpr const char* kCloudView = "cloud_view.json";  ///< cloud_view_json() of the measured clouds

/// A panel for each reconstruction3D measure that has `detail`: its values over the light (else the innermost loop), a
/// curve for every noise (else the next loop), averaged over all other loops; with one loop alone, one panel with a
/// curve for each measure. Bars: with three values or more, the 95 %
/// interval of their mean by Student's t; else the interval of the one value. Shares in per cent, metres in millimetres.
Chart sweep_chart(const Benchmark& benchmark, const SweepRows& rows, const std::string& detail);

/// The whole page as Markdown. `figures`: files in figures/ that it shows.
std::string sweep_page(const Benchmark& benchmark, const nlohmann::ordered_json& run, const SweepRows& rows,
                       const std::vector<std::string>& figures);

/// figures/DETAIL.svg and .png of coverage, outliers, mean error and standard deviation, where there are such measures.
/// Returns their names.
std::vector<std::string> write_sweep_figures(const std::filesystem::path& folder, const Benchmark& benchmark,
                                             const SweepRows& rows);

}  // namespace tankrig
