#include "pipeline/parameters.hpp"

#include <filesystem>

#include "core/settings_table.hpp"
#include "session/reading/session_rig_file.hpp"

namespace tankrig {
namespace {

using Parameters = PipelineParameters;
const Setting<Parameters> kMethodRows[] = {
    {"laser", &Parameters::laser, kStripeKeys},
    {"laser_paper", &Parameters::laser_paper, kPaperStripeKeys},
    {"stereo", &Parameters::stereo, kStereoKeys},
    {"stereo_paper", &Parameters::stereo_paper, kPaperStereoKeys},
};
constexpr SettingsTable<Parameters> kMethodKeys{kMethodRows};

const Setting<WorkspaceBox> kWorkspaceRows[] = {
    {"min_m", &WorkspaceBox::min, "corner of what clouds are cut to, in the arm's base; points outside are counted",
     Need::kRequired},
    {"max_m", &WorkspaceBox::max, "the opposite corner", Need::kRequired},
};
void check_workspace(const ConfigNode& node, const WorkspaceBox& box) {
  if (!(box.min.array() < box.max.array()).all()) node.fail("max_m", "expected every number above its one in min_m");
}
constexpr SettingsTable<WorkspaceBox> kWorkspace{kWorkspaceRows, check_workspace};

void read_workspace(const ConfigNode& node, const char* key, Parameters& p) {
  p.workspace = settings_from(node.child(key), kWorkspace);
}

const Setting<Parameters> kPipelineRows[] = {
    {"workspace",
     {read_workspace, nullptr, "", [](const std::string& place) { return settings_rows(place, kWorkspace); }}},
    {"reconstruction", kMethodKeys},
    {"evaluation", &Parameters::thresholds, kMetricKeys},
};
constexpr SettingsTable<Parameters> kPipeline{kPipelineRows};

}  // namespace

PipelineParameters pipeline_parameters(const ConfigNode& rig_file) {
  PipelineParameters out;
  read_settings(rig_file, kPipeline, out);
  for (const Setting<Parameters>& setting : kPipeline.rows)
    if (const auto section = rig_file.optional_child(setting.name)) section->finish();
  return out;
}

PipelineParameters pipeline_parameters(const Session& session) {
  if (session.info.kind == "import" && !std::filesystem::exists(session.path / "rig.yaml")) return {};
  return pipeline_parameters(session_rig_file(session.path));
}

std::string pipeline_key_rows() { return settings_rows("", kPipeline); }

}  // namespace tankrig
