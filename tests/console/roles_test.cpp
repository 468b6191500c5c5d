// Who may do what, row by row as the operator's manual says it.
#include "console/server/roles.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace tankrig {
namespace {

struct Expected {
  Role least;
  std::vector<const char*> acts;
};

const std::vector<Expected>& manual() {
  static const std::vector<Expected> table{
      {Role::kWatch,
       {"GET /", "GET /console.css", "GET /console.js", "GET /live", "GET /sessions", "GET /benchmarks",
        "GET /experiments", "GET /downloads", "GET /api/sessions", "say stop", "GET /platform.js", "GET /api/platform",
        "GET /api/datasets", "GET /api/submissions", "GET /submissions", "GET /datasets", "GET /files"}},
      {Role::kOperate,
       {"GET /api/arm",   "GET /api/doctor", "GET /api/plan", "GET /api/path", "say take", "say offer",
        "say release",    "say start",       "say answer",    "say hold",      "run scan", "run preview",
        "run lit",        "run jog",         "say rig",       "run park",      "run home", "run make_safe",
        "run experiment", "run bench",       "run check",     "upload"}},
      {Role::kAdminister,
       {"say corners", "run calibrate", "run report", "run recover", "", "say ", "run ", "say anything", "run emulate",
        "GET /anything", "GET /api/anything", "stop", "run scan --out=/x", "SAY STOP"}}};
  return table;
}

TEST(Roles, MayDoWhatTheManualSaysAndNothingElse) {
  for (const Expected& expected : manual())
    for (const char* act : expected.acts)
      for (const Role role : {Role::kWatch, Role::kOperate, Role::kAdminister})
        EXPECT_EQ(may(role, act), role >= expected.least) << name_of(role) << ": " << act;
}

TEST(Roles, HaveNoRightThatTheManualDoesNotName) {
  std::set<std::string_view> named;
  for (const Expected& expected : manual()) named.insert(expected.acts.begin(), expected.acts.end());
  std::set<std::string_view> in_table;
  for (const Right& right : kRights) {
    EXPECT_TRUE(named.contains(right.act)) << right.act;
    EXPECT_TRUE(in_table.insert(right.act).second) << right.act << " twice";
  }
}

TEST(Roles, SeeWhatLiesInAFolderByOneRight) {
  EXPECT_EQ(get_act("/sessions/a/report.html"), "GET /sessions");
  EXPECT_EQ(get_act("/downloads/a.zip"), "GET /downloads");
  EXPECT_EQ(get_act("/experiments/a/report.html"), "GET /experiments");
  EXPECT_EQ(get_act("/sessionsx"), "GET /sessionsx");
  EXPECT_EQ(get_act("/api/submissions/7"), "GET /api/submissions");
  EXPECT_EQ(get_act("/api/path/fine"), "GET /api/path");
  EXPECT_EQ(get_act("/"), "GET /");
}

}  // namespace
}  // namespace tankrig
