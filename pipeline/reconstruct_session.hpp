// From a session to clouds: the four methods on the same frames, with the rig file's parameters.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/parameters.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// `fraction` of `stage` is done, in [0, 1]. Empty: no progress is wanted.
/// Threads: any may call it.
using ProgressCallback = std::function<void(const std::string& stage, double fraction)>;

/// The methods in the order they are reported.
inline const std::vector<std::string> kMethods{"laser", "laser_paper", "stereo", "stereo_paper"};

/// Whether the method uses the mono camera's stripe; the others use the stereo pair.
inline bool by_laser(std::string_view method) { return method.starts_with("laser"); }

struct Reconstruction {
  std::string method;
  PointCloud cloud;             ///< in b for a scan, in c for an imported session
  std::vector<StripeRow> rows;  ///< laser methods: every stripe point
  StripeOrientation orientation = StripeOrientation::kColumns;
  double orientation_share = 1;  ///< of the evidence for either orientation, what speaks for this one; 1: it was given
  std::size_t rejected = 0;      ///< candidate points turned down by the method
  nlohmann::json rejections;     ///< by reason
  std::string reason;            ///< why the cloud is empty
  std::string warning;           ///< why the cloud may say little; mostly empty
  double seconds = 0;
};

bool contains(const WorkspaceBox& box, const Vector3d& p);

/// Frames of one camera, in file order.
std::vector<const FrameRecord*> frames_of(const Session& session, const CalibratedCamera& camera,
                                          bool (*wanted)(const FrameRecord&));

/// Reconstructs; writes nothing.
/// Errors: InputError if the session lacks what the method needs.
Reconstruction reconstruct_session(const Session& session, const PipelineParameters& parameters,
                                   const std::string& method, const ProgressCallback& progress = {});

/// clouds/stripe.csv, or clouds/stripe_paper.csv.
std::filesystem::path stripe_file(const Session& session, const std::string& method);

/// Writes clouds/METHOD.ply and .pcd, and the stripe_file() of the laser methods.
void write_clouds(const Session& session, const Reconstruction& reconstruction);

}  // namespace tankrig
