// Files are written whole by one function, under one temporary suffix: no seal can take in what is not finished.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/architecture/include_rule.hpp"

namespace tankrig::testing {
namespace {

constexpr char kForeign[] = "examples/algorithms/";               // know nothing of tankrig; read after their exit code
constexpr char kGrows[] = "sim_backends/wire/emulated_tank.cpp";  // what was exposed, line by line, in no session

TEST(UnfinishedFiles, HaveOneSuffixAndNoStreamWritesAFileInItsPlace) {
  const std::filesystem::path root = TANKRIG_SOURCE_DIR;
  for (const std::string& source : sources_of(root)) {
    if (source.starts_with("tests/") || source.starts_with("core/atomic_file.")) continue;
    std::stringstream text;
    text << std::ifstream(root / source).rdbuf();
    for (const char* suffix : {".tmp\"", ".tmp-", ".part\"", ".partial\""})
      EXPECT_EQ(text.str().find(suffix), std::string::npos) << source << ": " << suffix << ", expected kUnfinished";
    if (source == kGrows || source.starts_with(kForeign)) continue;
    for (const char* writer :
         {"std::ofstream", "std::fstream", "fopen(", "imwrite(", "cv::FileStorage ", "cv::FileStorage("})
      EXPECT_EQ(text.str().find(writer), std::string::npos)
          << source << ": " << writer << ", expected write_file_durably()";
  }
}

}  // namespace
}  // namespace tankrig::testing
