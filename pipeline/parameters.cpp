#include "pipeline/parameters.hpp"

#include <filesystem>

#include "session/reading/session_rig_file.hpp"

namespace tankrig {
namespace {

/// Reads one sub-section of `reconstruction` with its own reader.
template <class Parameters, class Reader>
void read_section(const std::optional<ConfigNode>& reconstruction, const char* name, Parameters& out, Reader reader) {
  if (!reconstruction) return;
  if (const auto node = reconstruction->optional_child(name)) out = reader(*node);
}

WorkspaceBox workspace_from(const ConfigNode& node) {
  const std::vector<double> low = node.numbers("min_m", 3), high = node.numbers("max_m", 3);
  const WorkspaceBox box{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  if (!(box.min.array() < box.max.array()).all()) node.fail("max_m", "expected every number above its one in min_m");
  return box;
}

}  // namespace

PipelineParameters pipeline_parameters(const ConfigNode& rig_file) {
  PipelineParameters out;
  const auto reconstruction = rig_file.optional_child("reconstruction");
  read_section(reconstruction, "laser", out.laser, stripe_parameters_from);
  read_section(reconstruction, "laser_paper", out.laser_paper, paper_stripe_parameters_from);
  read_section(reconstruction, "stereo", out.stereo, stereo_parameters_from);
  read_section(reconstruction, "stereo_paper", out.stereo_paper, paper_stereo_parameters_from);
  if (reconstruction) reconstruction->finish();
  if (const auto node = rig_file.optional_child("workspace")) {
    out.workspace = workspace_from(*node);
    node->finish();
  }
  if (const auto node = rig_file.optional_child("evaluation")) {
    out.thresholds = metric_thresholds_from(*node);
    node->finish();
  }
  return out;
}

PipelineParameters pipeline_parameters(const Session& session) {
  if (session.info.kind == "import" && !std::filesystem::exists(session.path / "rig.yaml")) return {};
  return pipeline_parameters(session_rig_file(session.path));
}

}  // namespace tankrig
