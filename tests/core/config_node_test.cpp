// Strict YAML: what is wrong is named with its line.
#include "core/config_node.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

class ConfigNodeTest : public testing::Test {
 protected:
  ConfigNode load(const std::string& text) { return ConfigNode::load(folder_.write("config_node_test.yaml", text)); }
  /// The message of the InputError that `action` throws; "" if it throws none.
  template <class F>
  std::string message(F action) {
    try {
      action();
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }
  TemporaryFolder folder_;
};

TEST_F(ConfigNodeTest, ReadsEveryKindOfValue) {
  const ConfigNode sut = load(
      "a: 1.5\nb: 3\nc: true\nd: word\ne: [1, -2e-3, +3]\nf:\n  translation_m: [1, 2, 3]\n  quaternion_xyzw: [0, 0, 0, "
      "1]\n");
  EXPECT_EQ(sut.number("a"), 1.5);
  EXPECT_EQ(sut.integer("b"), 3);
  EXPECT_TRUE(sut.flag("c"));
  EXPECT_EQ(sut.text("d"), "word");
  EXPECT_THAT(sut.numbers("e", 3), testing::ElementsAre(1, -2e-3, 3));
  EXPECT_EQ(sut.transform("f").translation(), Vector3d(1, 2, 3));
  EXPECT_EQ(sut.number_or("z", 9), 9);
  sut.finish();
}

TEST_F(ConfigNodeTest, NamesFileLineKeyValueAndExpectation) {
  const ConfigNode sut = load("ok: 1\nscan:\n  velocity: fast\n");
  const std::string text = message([&] { sut.child("scan").number("velocity", {0.01, 1}); });
  EXPECT_EQ(text, (folder_.path() / "config_node_test.yaml").string() +
                      ":3: scan.velocity: found 'fast', expected a number from 0.01 to 1");
}

TEST_F(ConfigNodeTest, RefusesNumbersOutOfRangeAndNotWhole) {
  const ConfigNode sut = load("a: 2\nb: 1.5\nc: .nan\n");
  EXPECT_THAT(message([&] { sut.number("a", {0, 1}); }), testing::HasSubstr(":1: a: found '2'"));
  EXPECT_THAT(message([&] { sut.integer("b"); }), testing::HasSubstr("expected a whole number"));
  EXPECT_THAT(message([&] { sut.number("c"); }), testing::HasSubstr("expected a number"));
}

TEST_F(ConfigNodeTest, RefusesUnknownKeysAtAnyDepth) {
  const ConfigNode sut = load("a: 1\nb:\n  c: 2\n  typo: 3\n");
  sut.number("a");
  sut.child("b").number("c");
  EXPECT_THAT(message([&] { sut.finish(); }), testing::HasSubstr(":4: b.typo: unknown key"));
}

TEST_F(ConfigNodeTest, RefusesAKeyThatStandsTwice) {
  EXPECT_THAT(message([&] { load("a: 1\na: 2\n"); }), testing::HasSubstr(":2: a: stands twice"));
}

TEST_F(ConfigNodeTest, NamesTheLineOfBrokenYamlAndTheMissingFile) {
  EXPECT_THAT(message([&] { load("a: [1, 2\nb: 3\n"); }), testing::HasSubstr("expected valid YAML"));
  EXPECT_THAT(message([&] { load("a: 1\nb: caf\xe9\n"); }),
              testing::HasSubstr(":2: found byte 0xe9, expected printable UTF-8"));
  EXPECT_THAT(message([&] { load(std::string("a: 1\n\n\0", 7)); }), testing::HasSubstr(":3: found byte 0x00"));
  EXPECT_THAT(message([] { ConfigNode::load("/nonexistent/rig.yaml"); }),
              testing::HasSubstr("/nonexistent/rig.yaml: cannot be read"));
}

TEST_F(ConfigNodeTest, RefusesAPathThatNoYamlFileCanHold) {
  const auto folder = folder_.path() / "jos\xe9";
  std::filesystem::create_directory(folder);
  std::filesystem::copy(folder_.write("rig.yaml", "mesh: box.stl\n"), folder);
  EXPECT_THAT(message([&] { ConfigNode::load(folder / "rig.yaml").path("mesh"); }),
              testing::HasSubstr("jos?/box.stl', expected folders with names in UTF-8"));
}

TEST_F(ConfigNodeTest, ShowsBinaryAndHugeValuesOnOneShortLine) {
  const std::string huge(100000, 'x');
  const auto expect_short = [](const std::string& text) {
    EXPECT_NE(text, "");
    EXPECT_LT(text.size(), 400u);
    for (const char c : text) EXPECT_GE(static_cast<unsigned char>(c), 0x20u) << text;
  };
  expect_short(message([&] { load(huge); }));
  expect_short(message([&] { load("a: *" + huge); }));
  expect_short(message([&] { load(huge.substr(0, 900) + ": 1\n" + huge.substr(0, 900) + ": 2\n"); }));
  expect_short(message([&] { load("? |\n  " + huge + "\n: 1\n").finish(); }));
  expect_short(message([&] { load("a: " + huge).number("a"); }));
  expect_short(message([&] { load("a: " + huge).choice("a", {"b"}); }));
  expect_short(message([&] { load("a: [" + huge + "]").numbers("a"); }));
  expect_short(message([&] { load("? |\n  " + huge + "\n: {b: c}\n").child(huge + "\n").number("b"); }));
  EXPECT_THAT(message([&] { load("a: \"1\\n\\e[2J\"\n").number("a"); }),
              testing::HasSubstr("a: found '1??[2J', expected"));
  std::string bytes;
  for (int i = 0; i < 4096; ++i) bytes += static_cast<char>(i * 167 >> 3);
  expect_short(message([&] { load(bytes); }));
}

TEST_F(ConfigNodeTest, RefusesAQuaternionOfTheWrongLengthAtItsLine) {
  const ConfigNode sut = load("pose:\n  translation_m: [0, 0, 0]\n  quaternion_xyzw: [0, 0, 0, 2]\n");
  EXPECT_THAT(message([&] { sut.transform("pose"); }),
              testing::HasSubstr(":3: pose.quaternion_xyzw: quaternion has norm 2"));
}

}  // namespace
}  // namespace tankrig
