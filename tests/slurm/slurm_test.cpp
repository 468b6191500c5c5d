// `tankrig bench --slurm` on a Slurm of Debian's: four shards are one run to the bit, and a lost one runs alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/program/program.hpp"
#include "tests/slurm/own_slurm.hpp"
#include "tests/support/sanitizers.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Five configurations of two scans. Its algorithm kills the task of shard 3 in its second configuration, once.
fs::path benchmark_that_kills_shard_3(const fs::path& folder) {
  const fs::path killed = folder / "killed";
  write_text(folder / "cloud.sh", R"(#!/bin/sh
if [ ! -e ')" + killed.string() + R"(' ] && tr '\0' '\n' < /proc/$PPID/environ | grep -qx SLURM_ARRAY_TASK_ID=3; then
  echo > ')" + killed.string() + R"('
  kill -KILL $(cut -d' ' -f4 /proc/$PPID/stat)
  exec sleep 1000
fi
cat > $2 <<'END'
ply
format ascii 1.0
element vertex 2
property float x
property float y
property float z
comment frame b
end_header
-0.26 0.025 1.02
-0.27 0.03 1.02
END
)");
  fs::permissions(folder / "cloud.sh", fs::perms::owner_all);
  const auto cloud = [](const std::string& name) {
    return "<reconstruction3D detailedResultsToGlobals=\"true\"><name>" + name +
           "</name><target>object</target><topic>" + name +
           "</topic><from>base</from><startOn><type>onInit</type></startOn><stopOn><type>never</type></stopOn>"
           "</reconstruction3D>";
  };
  const fs::path file = folder / "bench mark's.xml";
  write_text(file,
             "<benchmark><algorithms><algorithm><name>script</name><program>./cloud.sh</program><uses>laser</uses>"
             "</algorithm></algorithms><measures>" +
                 cloud("laser") + cloud("script") +
                 "</measures><startOn><type>onInit</type></startOn><stopOn><type>never</type></stopOn>"
                 "<function>laser.coverage</function><sceneUpdater><repeat><iterations>2</iterations><interval>0"
                 "</interval><sceneUpdater><sceneLightUpdater><initialValue>0</initialValue><finalValue>1"
                 "</finalValue><step>0.25</step><interval>0</interval></sceneLightUpdater></sceneUpdater></repeat>"
                 "</sceneUpdater></benchmark>\n");
  return file;
}

TEST(Slurm, FourShardsAreOneRunToTheBitAndALostOneRunsAlone) {
  TANKRIG_SKIP_SANITIZED("the algorithm's memory is limited");
  if (const std::string why = why_no_slurm(); !why.empty()) GTEST_SKIP() << why;
  const fs::path rig = small_rig(scratch_folder() / "rig"), shards = scratch_folder() / "shards of it";
  const fs::path file = benchmark_that_kills_shard_3(scratch_folder());
  const auto folder = [](const char* name) { return scratch_folder() / name; };
  const ProgramRun one = run_tankrig({"bench", file, "--rig", rig, "--out", folder("one"), "--seed", "7", "--json"});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_GT(one.json()["first_scan_cpu_s"], 0.01);
  EXPECT_GT(one.json()["sweep_cpu_s"], 0.01);
  EXPECT_GT(one.json()["peak_mib"], 10);
  EXPECT_EQ(one.json()["points_bytes"], fs::file_size(folder("one") / "points.jsonl"));

  const OwnSlurm slurm(folder("slurm"));
  const auto submit = [&] {
    return run_tankrig(
        {"bench", file, "--rig", rig, "--out", shards, "--seed", "7", "--slurm", "4", "--sbatch", "time=10", "--json"});
  };
  const auto merge = [&](const fs::path& out) {
    std::vector<std::string> words{"bench", "merge", file, "--out", out, "--json"};
    for (const char* i : {"1", "2", "3", "4"}) words.push_back((shards / (i + std::string("-of-4"))).string());
    return run_tankrig(words);
  };
  const ProgramRun first = submit();
  ASSERT_EQ(first.exit_code, 0) << first.err << slurm.logs();
  EXPECT_THAT(first.json()["submitted"], ElementsAre(1, 2, 3, 4));
  slurm.wait_for(first.json()["job"]);
  const ProgramRun part = merge(folder("part"));
  EXPECT_EQ(part.exit_code, 3);
  EXPECT_THAT(part.json()["lost"], ElementsAre("3/4")) << read_text(shards / "logs/1-of-4.txt");
  EXPECT_THAT(part.err, HasSubstr("shard 3/4 is lost: "));

  const std::string whole = read_text(shards / "1-of-4/points.jsonl");
  const ProgramRun again = submit();
  ASSERT_EQ(again.exit_code, 0) << again.err << slurm.logs();
  EXPECT_THAT(again.json()["submitted"], ElementsAre(3));
  EXPECT_EQ(again.json()["whole"], 3);
  EXPECT_THAT(again.err, HasSubstr("shard 3/4 is lost: "));
  slurm.wait_for(again.json()["job"]);
  ASSERT_EQ(merge(folder("all")).exit_code, 0) << read_text(shards / "logs/3-of-4.txt");
  for (const char* same : {"results.csv", "results.json", "results.md", "report.html"})
    EXPECT_EQ(read_text(folder("all") / same), read_text(folder("one") / same)) << same;
  EXPECT_EQ(read_text(shards / "1-of-4/points.jsonl"), whole);
  const ProgramRun third = submit();
  EXPECT_EQ(third.json()["whole"], 4);
  EXPECT_TRUE(third.json()["job"].is_null());
}

TEST(Slurm, AShardInTheQueueIsNotSubmittedTwice) {
  if (const std::string why = why_no_slurm(); !why.empty()) GTEST_SKIP() << why;
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const fs::path file = benchmark_that_kills_shard_3(scratch_folder());
  const OwnSlurm slurm(scratch_folder() / "slurm");
  const auto submit = [&](const std::string& option) {
    return run_tankrig({"bench", file, "--rig", rig, "--out", scratch_folder() / "shards", "--slurm", "4", "--sbatch",
                        option, "--json"});
  };
  EXPECT_THAT(submit("partition=moon").err, HasSubstr("sbatch ended with exit code 1"));
  const ProgramRun held = submit("hold");
  ASSERT_EQ(held.exit_code, 0) << held.err << slurm.logs();
  EXPECT_THAT(held.json()["submitted"], ElementsAre(1, 2, 3, 4));
  const ProgramRun again = submit("hold");
  EXPECT_EQ(again.json()["waiting"], 4);
  EXPECT_TRUE(again.json()["submitted"].empty());
  EXPECT_THAT(again.err, Not(HasSubstr("is lost")));
}

}  // namespace
}  // namespace tankrig::test
