// The spool, byte by byte: what is written reads back, and a cut or a flipped bit costs the frames it touches, no
// other.
#include "session/recording/spool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <random>

#include "session/checking/crc32.hpp"
#include "session/reading/session_tables.hpp"
#include "session/recording/png_file.hpp"
#include "session/recording/spool_pictures.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

FrameRecord filed(int index) {
  FrameRecord frame = some_frame(index);
  frame.file = "frames/mono/" + std::to_string(index) + ".png";
  return frame;
}

fs::path spooled(const TemporaryFolder& folder, int frames) {
  fs::create_directories(folder.path() / "spool");
  const fs::path file = folder.path() / "spool/000000.raw";
  SpoolWriter writer(file);
  for (int i = 0; i < frames; ++i) writer.append(static_cast<std::uint64_t>(i), frames_line(filed(i)), test_image(i));
  return file;
}

void expect_frames(const SpoolSegment& segment, const std::vector<int>& indices) {
  ASSERT_EQ(segment.frames().size(), indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const SpooledFrame& frame = segment.frames()[i];
    EXPECT_EQ(frame.number, static_cast<std::uint64_t>(indices[i]));
    EXPECT_EQ(frame.line, frames_line(filed(indices[i])));
    EXPECT_EQ(cv::norm(frame.image, test_image(indices[i]), cv::NORM_INF), 0);
  }
}

TEST(Crc32, IsThatOfPngAndEthernet) {
  EXPECT_EQ(crc32("123456789"), 0xcbf43926U);
  EXPECT_EQ(crc32(""), 0U);
  EXPECT_EQ(crc32("6789", crc32("12345")), 0xcbf43926U);
  EXPECT_EQ(crc32("IEND"), 0xae426082U) << "the last bytes of every PNG";
}

TEST(Spool, ReadsBackWhatWasWritten) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const SpoolSegment segment(spooled(folder, 3));
  expect_frames(segment, {0, 1, 2});
  EXPECT_EQ(segment.stray_bytes(), 0U);
}

TEST(Spool, KeepsEveryWholeFrameWhenItIsCutAtAnyByte) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const std::string whole = (spooled(folder, 3), folder.read("spool/000000.raw"));
  const std::size_t second = whole.find("TANKFRM1", 1), third = whole.find("TANKFRM1", second + 1);
  for (std::size_t bytes = 0; bytes < whole.size(); ++bytes) {
    const SpoolSegment segment(folder.write("cut" + std::to_string(bytes) + ".raw", whole.substr(0, bytes)));
    const std::size_t frames = bytes < second ? 0 : bytes < third ? 1 : 2;
    const std::size_t end = bytes < second ? 0 : bytes < third ? second : third;
    ASSERT_EQ(segment.frames().size(), frames) << bytes;
    EXPECT_EQ(segment.stray_bytes(), bytes - end);
  }
}

TEST(Spool, LosesOnlyTheFrameABitOfWhichIsFlipped) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const std::string whole = (spooled(folder, 3), folder.read("spool/000000.raw"));
  const std::size_t second = whole.find("TANKFRM1", 1), third = whole.find("TANKFRM1", second + 1);
  for (std::size_t at = second; at < third; ++at) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    const SpoolSegment segment(folder.write("flipped" + std::to_string(at) + ".raw", flipped));
    expect_frames(segment, {0, 2});
    EXPECT_EQ(segment.stray_bytes(), third - second) << at;
  }
}

TEST(Spool, BecomesPicturesAndIsGone) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  spooled(folder, 4);
  std::vector<double> progress;
  EXPECT_TRUE(write_spooled_pictures(folder.path(), {[&](double f) { progress.push_back(f); }, nullptr}));
  EXPECT_FALSE(has_spool(folder.path()));
  EXPECT_EQ(progress.back(), 1);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(is_whole_png(folder.read("frames/mono/" + std::to_string(i) + ".png")));
  EXPECT_TRUE(write_spooled_pictures(folder.path())) << "again, with nothing to do";
}

TEST(Spool, KeepsASegmentItDoesNotUnderstandWhole) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const fs::path file = spooled(folder, 2);
  fs::resize_file(file, fs::file_size(file) - 1);
  EXPECT_TRUE(write_spooled_pictures(folder.path()));
  EXPECT_TRUE(fs::exists(folder.path() / "frames/mono/0.png"));
  EXPECT_TRUE(fs::exists(file));
}

TEST(Spool, WritesNoPictureOutsideTheSession) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  fs::create_directories(folder.path() / "s/spool");
  FrameRecord astray = filed(0);
  astray.file = "../outside.png";
  SpoolWriter(folder.path() / "s/spool/000000.raw").append(0, frames_line(astray), test_image(0));
  EXPECT_TRUE(write_spooled_pictures(folder.path() / "s"));
  EXPECT_FALSE(fs::exists(folder.path() / "outside.png"));
  EXPECT_TRUE(has_spool(folder.path() / "s"));
}

TEST(Spool, StopsBetweenSegmentsWhenAsked) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  spooled(folder, 2);
  EXPECT_FALSE(write_spooled_pictures(folder.path(), {{}, [] { return true; }}));
  EXPECT_TRUE(has_spool(folder.path()));
}

TEST(Spool, StopsInTheMiddleOfASegmentAndGoesOnFromThere) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  constexpr int kMany = 200;
  spooled(folder, kMany);
  std::atomic<int> asked{0};
  EXPECT_FALSE(write_spooled_pictures(folder.path(), {{}, [&] { return ++asked > 20; }}));
  EXPECT_TRUE(fs::exists(folder.path() / "spool/000000.raw"));
  const auto pictures = [&] {
    return std::distance(fs::directory_iterator(folder.path() / "frames/mono"), fs::directory_iterator{});
  };
  EXPECT_GE(pictures(), 1);
  EXPECT_LT(pictures(), kMany / 2);
  EXPECT_TRUE(write_spooled_pictures(folder.path()));
  EXPECT_EQ(pictures(), kMany);
  EXPECT_FALSE(has_spool(folder.path()));
}

TEST(PngFile, IsWholeOnlyWithEveryByteAsWritten) {
  const std::string png = png_of(test_image(1), "a.png");
  ASSERT_TRUE(is_whole_png(png));
  EXPECT_FALSE(is_whole_png(png + "x"));
  for (std::size_t at = 0; at < png.size(); ++at) {
    EXPECT_FALSE(is_whole_png(std::string_view(png).substr(0, at))) << "cut at " << at;
    std::string flipped = png;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    EXPECT_FALSE(is_whole_png(flipped)) << "flipped in " << at;
  }
}

}  // namespace
}  // namespace tankrig
