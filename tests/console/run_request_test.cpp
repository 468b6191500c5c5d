// What the page may start: every wish becomes the words that a person would type, or is refused by name.
#include "console/server/run_request.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

using nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<OfferedCommand> offered() {
  return {{"scan",
           "Scan",
           "Scans.",
           {"scan", "--rig", "tank-sim"},
           {{"preset", "Preset", "--preset", FieldKind::kChoice, {"fine"}},
            {"light", "Light", "--light", FieldKind::kNumber, {}, "", false, {0, 0.1}},
            {"seed",
             "Seed",
             "--seed",
             FieldKind::kNumber,
             {},
             "",
             false,
             {0, std::numeric_limits<double>::infinity()},
             true},
            {"notes", "Notes", "--notes"}}},
          {"jog",
           "Jog",
           "Jogs.",
           {"arm", "jog"},
           {{"joint", "Joint", "", FieldKind::kWord, {"elbow"}, "", true},
            {"angle", "Angle", "", FieldKind::kWord, {}, "", true}},
           true,
           true},
          {"check",
           "Check",
           "Checks.",
           {"session", "check"},
           {{"session", "Session", "sessions", FieldKind::kFolder, {}, "", true}}}};
}

std::vector<std::string> words(const char* request) { return words_of(offered(), ordered_json::parse(request)); }

std::string refusal(const ordered_json& request) {
  try {
    words_of(offered(), request);
  } catch (const InputError& e) {
    return e.what();
  }
  return "taken";
}
std::string refusal(const char* request) { return refusal(ordered_json::parse(request)); }

TEST(RunRequest, BecomesTheWordsOfACommand) {
  EXPECT_THAT(words(R"({"command": "scan"})"), ElementsAre("scan", "--rig", "tank-sim"));
  EXPECT_THAT(
      words(R"({"command": "scan", "options": {"notes": "a b", "seed": 1e17, "light": 0.05, "preset": "fine"}})"),
      ElementsAre("scan", "--rig", "tank-sim", "--preset=fine", "--light=0.05", "--seed=100000000000000000",
                  "--notes=a b"));
  EXPECT_THAT(words(R"({"command": "jog", "options": {"joint": "elbow", "angle": -5}})"),
              ElementsAre("arm", "jog", "elbow", "-5"));
}

TEST(RunRequest, TakesNoTextForAnOption) {
  EXPECT_THAT(words(R"({"command": "scan", "options": {"notes": "--out=/etc"}})"),
              ElementsAre("scan", "--rig", "tank-sim", "--notes=--out=/etc"));
}

TEST(RunRequest, LeavesNoFolderButItsOwn) {
  EXPECT_THAT(words(R"({"command": "check", "options": {"session": "tank-1"}})"),
              ElementsAre("session", "check", "sessions/tank-1"));
  EXPECT_THAT(words(R"({"command": "check", "options": {"session": "--json"}})"),
              ElementsAre("session", "check", "sessions/--json"));
  for (const char* name : {"", ".", "..", "../x", "a/b", "/etc"})
    EXPECT_THAT(refusal({{"command", "check"}, {"options", {{"session", name}}}}), HasSubstr("folder in sessions"))
        << name;
}

TEST(RunRequest, RefusesByNameWhatIsNotOffered) {
  EXPECT_THAT(refusal(R"({"command": "emulate"})"), HasSubstr("emulate"));
  EXPECT_THAT(refusal(R"({"command": ["scan"]})"), HasSubstr("expected one that is offered"));
  EXPECT_THAT(refusal(R"({})"), HasSubstr("expected one that is offered"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"out": "/etc"}})"), HasSubstr("out"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": 5})"), HasSubstr("expected one"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"preset": "finer"}})"), HasSubstr("expected one of: fine"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"light": "1"}})"), HasSubstr("expected a number"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"light": null}})"), HasSubstr("expected a number"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"notes": "two\nlines"}})"), HasSubstr("one line"));
  EXPECT_THAT(refusal(R"({"command": "scan", "options": {"notes": "\u001b[2J"}})"), HasSubstr("one line"));
  EXPECT_THAT(refusal({{"command", "scan"}, {"options", {{"notes", std::string(501, 'x')}}}}), HasSubstr("500"));
  EXPECT_THAT(refusal(R"({"command": "jog", "options": {"joint": "--help", "angle": 1}})"), HasSubstr("elbow"));
  EXPECT_THAT(refusal(R"({"command": "jog", "options": {"joint": "elbow"}})"), HasSubstr("found nothing"));
}

TEST(RunRequest, RefusesANumberOutOfItsRangeInTheProgramsWords) {
  EXPECT_EQ(refusal(R"({"command": "scan", "options": {"light": 7}})"),
            "Light: found '7', expected a number from 0 to 0.1");
  EXPECT_EQ(refusal(R"({"command": "scan", "options": {"light": -0.01}})"),
            "Light: found '-0.01', expected a number from 0 to 0.1");
  EXPECT_EQ(refusal(R"({"command": "scan", "options": {"seed": 1.5}})"),
            "Seed: found '1.5', expected a whole number of at least 0");
  EXPECT_EQ(refusal(R"({"command": "scan", "options": {"light": 0.1, "seed": 0}})"), "taken");
}

TEST(RunRequest, DescribesEachFieldForThePage) {
  const ordered_json forms = forms_json(offered());
  ASSERT_EQ(forms.size(), 3U);
  EXPECT_EQ(forms[0]["fields"][0]["kind"], "choice");
  EXPECT_EQ(forms[0]["fields"][0]["choices"][0], "fine");
  const ordered_json light{{"least", 0.0}, {"most", 0.1}, {"whole", false}, {"expected", "a number from 0 to 0.1"}};
  EXPECT_EQ(forms[0]["fields"][1]["number"], light);
  EXPECT_FALSE(forms[0]["fields"][3].contains("number")) << "a text";
  EXPECT_EQ(forms[1]["fields"][1]["number"]["least"], nullptr);
  EXPECT_EQ(forms[1]["hold"], true);
  EXPECT_EQ(forms[1]["fields"][1]["required"], true);
}

}  // namespace
}  // namespace tankrig
