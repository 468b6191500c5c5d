// Who may include whom in this house, as a table; and a reader of the tree that finds who does otherwise.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tankrig::testing {

/// Broken rules, each "FILE:LINE: what is wrong".
using Violations = std::vector<std::string>;

/// Tells whether a path relative to the root is a file of the tree.
using Exists = std::function<bool(const std::string&)>;

/// Checks one source as if it lay at `file`, relative to the root, '/' between folders.
Violations check_source(const std::string& file, const std::string& text, const Exists& exists);

/// The C++ sources below `root`, relative to it, in order; hidden folders, build folders and sessions are left out.
std::vector<std::string> sources_of(const std::filesystem::path& root);

Violations check_tree(const std::filesystem::path& root);

}  // namespace tankrig::testing
