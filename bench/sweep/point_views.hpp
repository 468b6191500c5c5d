// What was seen in a configuration and made of it, as small pictures behind its dot on a page: a line for each in
// FOLDER/views.jsonl, {"point": N, "views": [{"caption", "measure", "jpeg": base64}, ...]}.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tankrig {

struct PointView {
  std::string caption;
  std::string measure;  ///< whose cloud it shows; empty: a camera's frame
  std::string jpeg;     ///< base64
};

using PointViews = std::map<std::size_t, std::vector<PointView>>;

/// Adds a line. A later one of the same configuration counts.
/// Errors: CannotWrite.
void add_views(const std::filesystem::path& folder, std::size_t point, const std::vector<PointView>& views);

/// Empty where there is no such file. What was cut is left out: a page shows these configurations without pictures.
/// Errors: InputError, also for what is no base64.
PointViews read_views(const std::filesystem::path& folder);

}  // namespace tankrig
