// The parts of a benchmark file that measures and updaters share: names, numbers, positions.
#pragma once

#include <string>

#include "bench/benchmark/benchmark.hpp"
#include "core/xml_element.hpp"

namespace tankrig {

/// A number as the reference module reads it: decimal, or M_PI, M_PI_2, M_PI_4, negative too.
double benchmark_number(const XmlElement& element, Bounds bounds = {});
double benchmark_number(const XmlElement& parent, const char* child, Bounds bounds = {});
Vector3d benchmark_position(const XmlElement& element);

/// The element's value in `names`, by the element's text or, with `name`, by that name.
/// Errors: InputError that lists what is known.
template <class Enum>
Enum benchmark_choice(const XmlElement& element, const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < kNames<Enum>.size(); ++i) {
    if (name == kNames<Enum>[i]) return static_cast<Enum>(i);
    known += (i ? ", " : "") + std::string(kNames<Enum>[i]);
  }
  element.fail("<" + element.name() + ">: found '" + name + "', expected one of: " + known);
}

/// As muParser's variables are called, so that a function can name it.
bool is_benchmark_name(const std::string& name);

/// An <algorithm>.
Algorithm read_algorithm(const XmlElement& element);

/// What <algorithms> holds.
std::vector<Algorithm> read_algorithms(const XmlElement& element);

/// What <sceneUpdater> holds, nested ones after it.
void read_updaters(const XmlElement& element, std::vector<Updater>& updaters);

}  // namespace tankrig
