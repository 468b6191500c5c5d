// A table of settings: read, refused with file and line, written, documented.
#include "core/settings_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

enum class Colour : std::uint8_t { kRed, kGreen };

}  // namespace

template <>
inline constexpr std::array kNames<Colour>{"red", "green"};

namespace {

using testing::HasSubstr;

struct Part {
  double gap = 0.002;
  std::string name;
};

struct Whole {
  double length = 1;
  int count = 2;
  std::uint8_t byte = 3;
  std::uint64_t large = 0;
  bool flag = true;
  Duration wait = std::chrono::milliseconds(5);
  Colour colour = Colour::kGreen;
  std::optional<double> perhaps;
  std::array<double, kJoints> joints{1, 2, 3, 4, 5};
  std::vector<double> list{0.1};
  std::vector<std::string> texts;
  Transform pose = Transform::Identity();
  Plane plane;
  int rare = 0;
  Part part, inlined;
};

const Setting<Part> kPartRows[] = {
    {"gap_mm", &Part::gap, ConfigRange(0, 10), "between two"},
    {"name", &Part::name, "of it"},
};
void check_part(const ConfigNode& node, const Part& part) {
  if (part.name == "bad") node.fail("name", "found bad, expected good");
}
constexpr SettingsTable<Part> kPart{kPartRows, check_part};

const Setting<Part> kGapRows[] = {{"hole_mm", &Part::gap, ConfigRange(0, 10), ""}};
constexpr SettingsTable<Part> kGap{kGapRows};

const Setting<Whole> kWholeRows[] = {
    {"length_m", &Whole::length, ConfigRange(0, 15), "of the whole", Need::kRequired},
    {"count", &Whole::count, ConfigRange(0, 9), ""},
    {"byte", &Whole::byte, ConfigRange(0, 255), ""},
    {"large", &Whole::large, ""},
    {"flag", &Whole::flag, ""},
    {"wait_us", &Whole::wait, ConfigRange(0, 1e6), ""},
    {"colour", &Whole::colour, ""},
    {"perhaps", &Whole::perhaps, ConfigRange(-1, 1), ""},
    {"joints", &Whole::joints, ConfigRange(0, 9), ""},
    {"list", &Whole::list, ConfigRange(0, 1), ""},
    {"texts", &Whole::texts, ""},
    {"pose", &Whole::pose, ""},
    {"plane", &Whole::plane, ""},
    {"rare", &Whole::rare, ConfigRange(0, 9), "", Need::kSparse},
    {"part", &Whole::part, kPart},
    {"", &Whole::inlined, kGap},
};
constexpr SettingsTable<Whole> kWhole{kWholeRows};

std::string written(const Whole& whole) {
  YAML::Emitter out;
  write_mapping(out, kWhole, whole);
  return out.c_str();
}

Whole read(const std::string& text) { return settings_from(ConfigNode::parse(text, "whole.yaml"), kWhole); }

constexpr const char* kText = R"(length_m: 0.1
count: 7
byte: 200
large: 18446744073709551615
flag: false
wait_us: 1.5
colour: red
perhaps: -0.30000000000000004
joints: [0, 1, 2, 3, 4.5]
list: [0.3, 0.6]
texts: ["a", "b: \"c\""]
pose: {translation_m: [1, 2, 3], quaternion_xyzw: [0, 0, 0, 1]}
plane: {normal: [0, 1, 0], offset_m: -0.5}
rare: 4
part:
  gap_mm: 7
  name: "it's"
hole_mm: 1)";

TEST(SettingsTable, WritesWhatItReads) {
  const Whole whole = read(kText);
  EXPECT_EQ(whole.wait, std::chrono::nanoseconds(1500));
  EXPECT_EQ(whole.colour, Colour::kRed);
  EXPECT_EQ(whole.part.gap, 0.007);
  EXPECT_EQ(whole.inlined.gap, 0.001);
  EXPECT_EQ(written(whole), kText);
}

TEST(SettingsTable, KeepsDefaultsAndWritesTheRareOnlyWhereItIsThere) {
  const Whole whole = read("length_m: 1\n");
  EXPECT_EQ(written(whole), written(Whole{}));
  for (const char* key : {"perhaps", "rare"}) EXPECT_EQ(written(whole).find(key), std::string::npos) << key;
}

TEST(SettingsTable, SaysWhatIsWrongAndWhere) {
  const auto error = [](const std::string& text) {
    return message_of<InputError>([&] { read("length_m: 1\n" + text + "\n"); });
  };
  EXPECT_EQ(message_of<InputError>([] { read("count: 1\n"); }),
            "whole.yaml:1: length_m: found nothing, expected a number from 0 to 15");
  EXPECT_EQ(error("count: 10"), "whole.yaml:2: count: found '10', expected a number from 0 to 9");
  EXPECT_EQ(error("large: -1"), "whole.yaml:2: large: found '-1', expected a whole number of at least 0");
  EXPECT_EQ(error("colour: blue"), "whole.yaml:2: colour: found 'blue', expected one of: red, green");
  EXPECT_EQ(error("joints: [0, 0, 0, 0, 10]"),
            "whole.yaml:2: joints: found [0, 0, 0, 0, 10], expected five numbers from 0 to 9");
  EXPECT_EQ(error("list: [2]"), "whole.yaml:2: list: found [2], expected numbers from 0 to 1");
  EXPECT_EQ(error("part:\n  name: bad"), "whole.yaml:3: part.name: found bad, expected good");
  EXPECT_THAT(error("part: {size: 1}"), HasSubstr("whole.yaml:2: part.size: unknown key"));
}

TEST(SettingsTable, DocumentsPlaceDefaultRangeAndMeaning) {
  const std::string rows = settings_rows("top", kWhole);
  EXPECT_THAT(rows, HasSubstr("| `top.length_m` | required | 0 to 15 | of the whole |\n"));
  EXPECT_THAT(rows, HasSubstr("| `top.perhaps` | none | -1 to 1 |  |\n"));
  EXPECT_THAT(rows, HasSubstr("| `top.joints` | [1, 2, 3, 4, 5] | five numbers, each 0 to 9 |  |\n"));
  EXPECT_THAT(rows, HasSubstr("| `top.colour` | green | red, green |  |\n"));
  EXPECT_THAT(rows, HasSubstr("| `top.part.gap_mm` | 2 | 0 to 10 | between two |\n"));
  EXPECT_THAT(rows, HasSubstr("| `top.hole_mm` | 2 | 0 to 10 |  |\n"));
}

TEST(SettingsTable, WritesATextThatIsNoUtf8AsOneThatCanBeRead) {
  Whole whole;
  whole.part.name = "jos\xe9: 1";
  EXPECT_EQ(read(written(whole)).part.name, "jos\uFFFD: 1");
}

TEST(SettingsTable, WritesWholeDurationsAsWholeNumbersInEveryUnit) {
  using namespace std::chrono_literals;
  EXPECT_EQ(in_unit_of("wait_s", 60s), 60);
  EXPECT_EQ(in_unit_of("wait_ms", 1100ms), 1100);
  EXPECT_EQ(in_unit_of("wait_us", 300us), 300);
  for (int n = 1; n <= 600; ++n) EXPECT_EQ(in_unit_of("wait_s", std::chrono::seconds(n)), n);
}

}  // namespace
}  // namespace tankrig
