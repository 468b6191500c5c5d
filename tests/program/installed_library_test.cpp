// The library as other people's programs find it: installed, found by CMake, and one with the program in what it says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "tests/program/scanned_session.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

/// Standard output of `command`.  Fails the test, with all that it said, if it does not end with 0.
std::string said_by(const std::string& command) {
  const fs::path errors = scratch_folder() / "errors.txt";
  FILE* pipe = popen((command + " 2>" + errors.string()).c_str(), "r");
  std::string out;
  for (char buffer[4096]; const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe);) out.append(buffer, n);
  const int status = pclose(pipe);
  EXPECT_EQ(status, 0) << command << "\n" << out << read_text(errors);
  return out;
}

TEST(InstalledLibrary, BuildsAProgramThatScoresAsOursDoes) {
  const fs::path folder = scratch_folder(), prefix = folder / "prefix", build = folder / "build";
  said_by("cmake --install " TANKRIG_BUILD_DIR " --prefix " + prefix.string());
  said_by("cmake -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=" + prefix.string() + " -S " +
          TANKRIG_SOURCE_DIR "/examples/score_session -B " + build.string());
  said_by("cmake --build " + build.string());
  const auto ours = nlohmann::json::parse(read_text(scanned() / "results/laser.json"));
  char expected[128];
  std::snprintf(expected, sizeof expected, "%zu points, mean error %.3f mm, coverage %.2f %% of %.2f %%\n",
                ours.at("points").get<std::size_t>(), 1e3 * ours.at("mean_error_m").get<double>(),
                100 * ours.at("coverage").get<double>(), 100 * ours.at("coverage_ceiling").get<double>());
  // OpenCV as a whole can still be found beside it.
  fs::create_directory(folder / "beside");
  write_text(folder / "beside/CMakeLists.txt",
             "cmake_minimum_required(VERSION 3.22)\nproject(beside LANGUAGES CXX)\nfind_package(tankrig REQUIRED)\n"
             "find_package(OpenCV REQUIRED COMPONENTS core)\n");
  said_by("cmake -G Ninja -DCMAKE_PREFIX_PATH=" + prefix.string() + " -S " + (folder / "beside").string() + " -B " +
          (folder / "beside/build").string());
  EXPECT_EQ(said_by((build / "score_session").string() + " " + scanned().string()), expected);
}

}  // namespace
}  // namespace tankrig::test
