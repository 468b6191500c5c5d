// The pictures of an experiment, side by side: the paper's Figures 11 and 12.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig::app {

struct PicturedSession {
  std::string caption;  ///< "147 lx"
  std::filesystem::path path;
};

/// FOLDER/figures/kViewsOutside, kViewsCamera and kCloudGrid, a column for each session, of what their reports hold.
/// `clouds`: those of the last, one a row.
void write_experiment_figures(const std::filesystem::path& folder, const std::vector<PicturedSession>& sessions,
                              const std::vector<std::string>& clouds);

}  // namespace tankrig::app
