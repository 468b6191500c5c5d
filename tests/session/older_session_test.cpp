// Tables of sessions that were recorded before they had all of today's columns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "core/csv.hpp"
#include "session/checking/session_recover.hpp"
#include "session/recording/spool.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kLater{"sync_residual_mm", "stamp_sigma_ns"};  // in the order they came

/// A line as it was when the table had so many of the later columns.
std::string older_line(const std::string& line, std::size_t had) {
  const std::vector<std::string> columns = split_csv_line(frames_header().substr(0, frames_header().size() - 1));
  const std::vector<std::string> fields = split_csv_line(line.substr(0, line.size() - 1));
  std::string out;
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (std::find(kLater.begin() + static_cast<std::ptrdiff_t>(had), kLater.end(), columns[i]) == kLater.end())
      out += (out.empty() ? "" : ",") + fields[i];
  return out + "\n";
}

std::string older_table(const std::string& table, std::size_t had) {
  std::istringstream lines(table);
  std::string out;
  for (std::string line; std::getline(lines, line);) out += older_line(line + "\n", had);
  return out;
}

FrameRecord filed(int index) {
  FrameRecord frame = some_frame(index);
  frame.sync_on_target = 1.25e-3;
  frame.file = "frames/mono/00000" + std::to_string(index) + ".png";
  return frame;
}

class OlderSession : public testing::TestWithParam<std::size_t> {
 protected:
  void expect_as_it_was(const FrameRecord& read, int index) {
    const FrameRecord frame = filed(index);
    EXPECT_EQ(read.stamp, frame.stamp);
    EXPECT_EQ(read.sync_residual, frame.sync_residual);
    EXPECT_EQ(read.sync_on_target, GetParam() > 0 ? frame.sync_on_target : 0);
    EXPECT_EQ(read.stamp_sigma, GetParam() > 1 ? frame.stamp_sigma : Duration{0});
    EXPECT_EQ(read.file, frame.file);
  }
  const TemporaryFolder folder_;
  const fs::path path_ = folder_.path() / "s";
};
INSTANTIATE_TEST_SUITE_P(Had, OlderSession, testing::Values(0, 1, 2), [](const auto& had) {
  return had.param == 0 ? "NoneOfThem" : had.param == 1 ? "TheResidualInMillimetres" : "AllOfThem";
});

TEST_P(OlderSession, IsReadLineByLineAndAsAWhole) {
  std::string table = older_line(frames_header(), GetParam());
  for (int i = 0; i < 3; ++i) {
    const std::string line = older_line(frames_line(filed(i)), GetParam());
    const auto read = parse_frames_line(line);
    ASSERT_TRUE(read) << line;
    expect_as_it_was(*read, i);
    table += line;
  }
  const auto read = read_frames_csv(folder_.write("frames.csv", table));
  ASSERT_EQ(read.records.size(), 3u);
  for (int i = 0; i < 3; ++i) expect_as_it_was(read.records[static_cast<std::size_t>(i)], i);
}

TEST_P(OlderSession, ThatWasCutIsRecoveredWholeAlsoWhereATableIsWrittenAgain) {
  for (const bool damaged : {false, true}) {
    SCOPED_TRACE(damaged);
    fs::remove_all(path_);
    {
      SessionInfo info = some_info();
      info.rig_hash.clear();
      info.object.reset();
      SessionWriter writer(path_, info);
      for (int i = 0; i < 2; ++i) writer.frame(filed(i), test_image(i));
      writer.close("complete");
    }
    std::string table = older_table(folder_.read("s/frames.csv"), GetParam());
    if (damaged) table.insert(table.find('\n') + 1, "torn\n");
    folder_.write("s/frames.csv", table);
    fs::create_directory(path_ / "spool");
    SpoolWriter(path_ / "spool/000000.raw").append(2, older_line(frames_line(filed(2)), GetParam()), test_image(2));
    EXPECT_TRUE(recover_session(path_, {}).finished);
    EXPECT_TRUE(examine_session(path_, {}).whole());
    const Session session = Session::open(path_);
    ASSERT_EQ(session.frames.size(), 3u);
    for (int i = 0; i < 3; ++i) expect_as_it_was(session.frames[static_cast<std::size_t>(i)], i);
    EXPECT_EQ(cv::norm(session.image(session.frames[2]), test_image(2), cv::NORM_INF), 0);
  }
}

}  // namespace
}  // namespace tankrig
