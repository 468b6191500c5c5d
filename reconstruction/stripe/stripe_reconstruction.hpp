// A sweep of stripe images to one cloud.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/camera_model.hpp"
#include "core/config_node.hpp"
#include "reconstruction/cloud/cloud.hpp"
#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "reconstruction/stripe/triangulation.hpp"

namespace tankrig {

/// One image of the sweep.
struct StripeFrame {
  std::function<cv::Mat()> load;  ///< called once or twice, from any thread; what it throws ends the reconstruction
  Plane cPl;                      ///< laser plane in the camera at mid-exposure
  int index = 0;                  ///< of the frame in its camera's sequence
  Transform aMc = Transform::Identity();  ///< camera in the cloud's frame a
};

/// Axis-aligned, in the cloud's frame [m].
struct WorkspaceBox {
  Vector3d min = Vector3d::Zero(), max = Vector3d::Zero();
};

struct StripeReconstructionParameters {
  /// Whose detector: ours or the paper's.
  std::variant<StripeParameters, PaperStripeParameters> detector = StripeParameters{};
  TriangulationParameters triangulation;
  std::optional<WorkspaceBox> workspace;  ///< points outside are rejected
  double particle_radius = 0.015;         ///< [m] a point with no neighbour this near from another frame ...
  int particle_run = 24;  ///< ... nor this many from its own within twice the radius, is a particle; 0: keep all
};

/// A line of stripe.csv.
struct StripeRow {
  int frame = 0;
  StripePeak peak;
};

struct StripeResult {
  PointCloud cloud;
  StripeStatistics statistics;
  StripeOrientation orientation = StripeOrientation::kColumns;
  double orientation_share = 1;  ///< of the evidence for either orientation, what speaks for this one; 1: it was given
  std::vector<StripeRow> rows;   ///< every stripe point found, in order of frames and columns
};

/// What one frame gives. Particles are still among the points.
struct StripeFrameResult {
  StripeDetection detection;
  std::vector<CloudPoint> points;  ///< in frame a, inside the workspace
};

/// One frame of a sweep whose stripe looks like `look`; `frame.load` is not called.
/// Errors: InputError if the image is of another size than the camera or the background.
StripeFrameResult reconstruct_frame(const cv::Mat& image, const StripeFrame& frame, const CameraModel& camera,
                                    const cv::Mat& background, const StripeReconstructionParameters& parameters,
                                    const StripeLook& look);

/// Frames are searched in parallel; the result does not depend on the number of threads. An orientation kAuto is
/// settled once, by the clearest of some frames. `background`: dark image, empty if there is none (the paper's detector
/// uses it for its orientation alone). `cloud_frame`: letter of frame a. `progress(done, total)` may be called from any thread, one call at a
/// time.
/// Errors: InputError if an image is of another size than the camera or the background.
StripeResult reconstruct_stripe(const std::vector<StripeFrame>& frames, const CameraModel& camera,
                                const cv::Mat& background, const StripeReconstructionParameters& parameters,
                                const std::string& cloud_frame,
                                const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Header frame,column_px,row_px,sigma_px,intensity; for kRows frame,row_px,column_px,sigma_px,intensity: the third is
/// the sub-pixel position. The file appears whole or not at all.
/// Errors: InputError if it cannot be written.
void write_stripe_csv(const std::filesystem::path& file, const std::vector<StripeRow>& rows,
                      StripeOrientation orientation);

}  // namespace tankrig
