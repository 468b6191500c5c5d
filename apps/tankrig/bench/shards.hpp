// A benchmark's configurations in parts, each with a folder of its own.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/benchmark/point_store.hpp"

namespace tankrig::app {

inline constexpr std::size_t kMostShards = 100'000;

/// "2/4": the second quarter of the configurations, in their order.
struct Shard {
  std::size_t index = 1, count = 1;

  std::string name() const;
  std::size_t begin(std::size_t points) const { return points * (index - 1) / count; }
  std::size_t end(std::size_t points) const { return points * index / count; }
  std::size_t size(std::size_t points) const { return end(points) - begin(points); }
  /// How many of its configurations `rows` lacks.
  std::size_t missing(const PointRows& rows, std::size_t points) const;

  /// Where a job array leaves it below `folder`: "2-of-4".
  std::filesystem::path folder_in(const std::filesystem::path& folder) const;
  /// What its task says, there too.
  std::filesystem::path log_in(const std::filesystem::path& folder) const;
};

/// Errors: InputError.
Shard read_shard(const std::string& text);

/// The shard that a folder's name says, "2-of-4"; none: another name.
std::optional<Shard> shard_of_folder(const std::filesystem::path& folder);

}  // namespace tankrig::app
