// Renders the guest's pictures on the host, where it is quick, as raw BGR, which nobody has to decode there:
//   render_pictures SCENE FOLDER
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include "sim_backends/world/tank_world.hpp"
#include "tests/kernel/rig/pictures.hpp"

int main(int argc, char** argv) try {
  using namespace tankrig;
  if (argc != 3) throw std::runtime_error("usage: render_pictures SCENE FOLDER");
  const std::filesystem::path folder = argv[2];
  const auto world = sim::TankWorld::load(argv[1], {});
  const auto& camera = world.cameras().at(0);
  std::filesystem::create_directories(folder);
  for (int n = 0; n < test::kDarkPictures + test::kLitPictures; ++n) {
    sim::Exposure exposure;
    exposure.q.fill(test::joints_of_lit_picture(n < test::kDarkPictures ? 0 : n - test::kDarkPictures));
    exposure.laser.fill(n < test::kDarkPictures ? 0 : 1);
    exposure.index = static_cast<std::uint64_t>(n);
    char name[16];
    std::snprintf(name, sizeof name, "%04d.raw", n);
    const cv::Mat picture = world.render(camera.name, exposure);
    const auto bytes = static_cast<std::streamsize>(picture.total() * picture.elemSize());
    std::ofstream file(folder / name, std::ios::binary);
    if (!file.write(reinterpret_cast<const char*>(picture.data), bytes)) throw std::runtime_error("cannot write");
  }
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "render_pictures: %s\n", e.what());
  return 1;
}
