// The benchmark platform: whoever is let in sends clouds and algorithms, which are queued, scored and ranked. It has no
// rig and starts no command of one.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "console/server/access.hpp"

namespace tankrig {

/// A session that its owner has published.
struct Dataset {
  std::string name;  ///< its folder's
  std::filesystem::path session;
  std::filesystem::path archive;  ///< what others may have of it
  bool laser = false, stereo = false;
  nlohmann::ordered_json facts;  ///< what the page says of it
};

/// Of a user, and of an address, each.
struct Quota {
  int uploads_per_hour = 30;
  std::uint64_t bytes_per_hour = 1ULL << 30;
  int waiting = 10;  ///< submissions that are not scored yet
};

struct PlatformOptions {
  std::string program;  ///< its path: `PROGRAM serve score` scores a submission
  std::string version;
  std::filesystem::path store;
  std::vector<Dataset> datasets;
  std::string no_algorithms;  ///< why none are taken; empty: they are
  Quota quota;
  int most_waiting = 5000;  ///< of all
  std::uint64_t most_cloud_bytes = 256ULL << 20, most_archive_bytes = 64ULL << 20;
  std::uint64_t free_bytes = 2ULL << 30;                    ///< of the disk, to be left
  int jobs = 1;                                             ///< scored at a time
  std::chrono::seconds longest = std::chrono::minutes{15};  ///< for one
  ListenOptions listen;
};

/// Until `stop` says so. What is being scored then is scored again by the next server.
/// `ready`: is told the address, once.
/// Errors: InputError if the address cannot be had or the store cannot be used.
void serve_platform(const PlatformOptions& options, const std::function<void(const std::string& address)>& ready,
                    const std::function<bool()>& stop);

}  // namespace tankrig
