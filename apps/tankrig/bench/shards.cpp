#include "apps/tankrig/bench/shards.hpp"

#include <fmt/format.h>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

std::optional<Shard> parsed(std::string_view text, std::string_view between) {
  Shard shard;
  const auto at = text.find(between);
  if (at == std::string_view::npos || !parse_number(text.substr(0, at), shard.index) ||
      !parse_number(text.substr(at + between.size()), shard.count) || shard.index < 1 || shard.index > shard.count ||
      shard.count > kMostShards)
    return std::nullopt;
  return shard;
}

std::string file_name(const Shard& shard) { return fmt::format("{}-of-{}", shard.index, shard.count); }

}  // namespace

std::string Shard::name() const { return fmt::format("{}/{}", index, count); }

std::size_t Shard::missing(const PointRows& rows, std::size_t points) const {
  std::size_t sum = 0;
  for (std::size_t point = begin(points); point < end(points); ++point) sum += !rows.contains(point);
  return sum;
}

fs::path Shard::folder_in(const fs::path& folder) const { return folder / file_name(*this); }

fs::path Shard::log_in(const fs::path& folder) const { return folder / "logs" / (file_name(*this) + ".txt"); }

Shard read_shard(const std::string& text) {
  if (const auto shard = parsed(text, "/")) return *shard;
  throw InputError("--shard: found '" + shown_text(text) + "', expected i/n, 1/1 to n/n");
}

std::optional<Shard> shard_of_folder(const fs::path& folder) {
  const fs::path whole = folder.has_filename() ? folder : folder.parent_path();  // "2-of-4/"
  return parsed(whole.filename().string(), "-of-");
}

}  // namespace tankrig::app
