// A method on tankrig's own library, for <algorithm>, with a parameter of one's own: library_cloud MIN_SNR SESSION CLOUD.ply
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "pipeline/reconstruct_session.hpp"
#include "reconstruction/cloud/cloud_io.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) return std::fprintf(stderr, "usage: library_cloud MIN_SNR SESSION CLOUD.ply\n"), 2;
  const tankrig::Session session = tankrig::Session::open(argv[2]);
  tankrig::PipelineParameters parameters = tankrig::pipeline_parameters(session);
  parameters.laser.min_snr = std::atof(argv[1]);
  const tankrig::Reconstruction made = tankrig::reconstruct_session(session, parameters, "laser");
  if (made.cloud.points.empty()) return std::fprintf(stderr, "library_cloud: %s\n", made.reason.c_str()), 1;
  tankrig::write_cloud(argv[3], made.cloud);
} catch (const std::exception& e) {
  return std::fprintf(stderr, "library_cloud: %s\n", e.what()), 1;
}
