// Scores a laser method on a recorded session, with a parameter of one's own: score_session SESSION [MIN_SNR]
#include "pipeline/score_session.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>

int main(int argc, char** argv) try {
  if (argc < 2) return std::fprintf(stderr, "usage: score_session SESSION [MIN_SNR]\n"), 2;
  const tankrig::Session session = tankrig::Session::open(argv[1]);
  tankrig::PipelineParameters parameters = tankrig::pipeline_parameters(session);
  if (argc > 2) parameters.laser.min_snr = std::atof(argv[2]);

  const tankrig::ObjectSurface object = tankrig::object_of(session, parameters.thresholds);
  const tankrig::Score score = tankrig::score_reconstruction(
      session, parameters.thresholds, object, tankrig::reconstruct_session(session, parameters, "laser"));
  if (!score.metrics.error) return std::printf("%s\n", score.reconstruction.reason.c_str()), 3;
  std::printf("%zu points, mean error %.3f mm, coverage %.2f %% of %.2f %%\n", score.reconstruction.cloud.points.size(),
              1e3 * score.metrics.error->mean, 100 * score.metrics.headline().whole, 100 * score.ceiling.share);
} catch (const std::exception& e) {
  return std::fprintf(stderr, "score_session: %s\n", e.what()), 1;
}
