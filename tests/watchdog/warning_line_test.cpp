// The lamp that warns of motion and light, on a line whose other end the test holds.
#include "drivers/watchdog/warning_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "core/input_error.hpp"
#include "sim_backends/wire/pty.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class WarningLineTest : public ::testing::Test {
 protected:
  /// The next four bytes on the lamp's line; fewer if no more come.
  std::vector<std::uint8_t> command() {
    constexpr std::size_t kBytes = 4;
    constexpr int kPatience_ms = 2000;
    std::vector<std::uint8_t> heard;
    while (heard.size() < kBytes) {
      pollfd waiting{lamp_.descriptor(), POLLIN, 0};
      if (::poll(&waiting, 1, kPatience_ms) != 1) break;
      std::array<std::uint8_t, kBytes> bytes{};
      const auto read = lamp_.try_read(std::span(bytes).first(kBytes - heard.size()));
      if (!read.ok()) break;
      heard.insert(heard.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(read.value()));
    }
    return heard;
  }

  const TemporaryFolder folder_;
  sim::Pty lamp_{folder_.path() / "lamp"};
  const WarningOutput settings_{.kind = WarningKind::kBytes, .device = lamp_.name().string()};
};

TEST_F(WarningLineTest, IsDarkWhenOpenedLitWhenSetAndDarkWhenClosed) {
  auto sut = open_warning_line(settings_, folder_.path());
  EXPECT_THAT(command(), ElementsAre(0xa0, 0x01, 0x00, 0xa1));
  ASSERT_TRUE(sut->set(true).ok());
  EXPECT_THAT(command(), ElementsAre(0xa0, 0x01, 0x01, 0xa2));
  sut.reset();
  EXPECT_THAT(command(), ElementsAre(0xa0, 0x01, 0x00, 0xa1));
}

TEST_F(WarningLineTest, ThatIsUnpluggedCannotBeLit) {
  const auto sut = open_warning_line(settings_, folder_.path());
  lamp_.unplug();
  EXPECT_FALSE(sut->set(true).ok());
}

TEST_F(WarningLineTest, WithoutControlLinesIsRefusedWithTheCure) {
  WarningOutput settings = settings_;
  settings.kind = WarningKind::kRts;
  try {
    open_warning_line(settings, folder_.path());
    FAIL() << "expected a refusal";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("has no control lines"));
    EXPECT_THAT(e.what(), HasSubstr("or kind: bytes, or none"));
  }
}

TEST(WarningLine, ThatIsNotConfiguredIsNone) { EXPECT_EQ(open_warning_line({}, "/"), nullptr); }

}  // namespace
}  // namespace tankrig
