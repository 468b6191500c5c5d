#include "tests/program/true_exposures.hpp"

#include <fstream>
#include <sstream>
#include <string>

namespace tankrig::test {

std::vector<TrueExposure> read_true_exposures(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<TrueExposure> out;
  while (std::getline(in, line) && !in.eof()) {
    std::istringstream cells(line);
    char comma;
    TrueExposure e{};
    if (cells >> e.index >> comma >> e.mid.ns >> comma >> e.elbow >> comma >> e.laser) out.push_back(e);
  }
  return out;
}

}  // namespace tankrig::test
