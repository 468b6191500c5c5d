// Files are written whole by one function, under one temporary suffix: no seal can take in what is not finished.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/architecture/include_rule.hpp"

namespace tankrig::testing {
namespace {

TEST(UnfinishedFiles, HaveOneSuffixAndNoStreamWritesAFileInItsPlace) {
  const std::filesystem::path root = TANKRIG_SOURCE_DIR;
  for (const std::string& source : sources_of(root)) {
    if (source.starts_with("tests/") || source.starts_with("core/atomic_file.")) continue;
    std::stringstream text;
    text << std::ifstream(root / source).rdbuf();
    for (const char* suffix : {".tmp\"", ".tmp-", ".part\"", ".partial\""})
      EXPECT_EQ(text.str().find(suffix), std::string::npos) << source << ": " << suffix << ", expected kUnfinished";
    if (!source.starts_with("sim_backends/")) {
      EXPECT_EQ(text.str().find("std::ofstream"), std::string::npos) << source << ", expected write_file_durably()";
    }
  }
}

}  // namespace
}  // namespace tankrig::testing
