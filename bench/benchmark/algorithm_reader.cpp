// From <algorithms> to the programs that a benchmark runs.
#include <set>

#include "bench/benchmark/benchmark_element.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kMostAlgorithms = 32, kMostArguments = 64;
constexpr Bounds kTime{0.1, 86'400}, kMebibytes{1, 1 << 20}, kProcesses{1, 4096};

std::uint64_t bytes(const XmlElement& element, const char* child, std::uint64_t otherwise) {
  return element.has(child) ? static_cast<std::uint64_t>(element.number(child, kMebibytes) * 0x1p20) : otherwise;
}

}  // namespace

Algorithm read_algorithm(const XmlElement& element) {
  element.expect(
      {"name", "program", "uses", "timeLimit", "processorTimeLimit", "memoryLimit", "diskLimit", "processLimit"},
      {"argument"});
  Algorithm algorithm;
  algorithm.line = element.line();
  algorithm.name = element.text("name");
  if (!is_benchmark_name(algorithm.name) || algorithm.name == kChosenCloud)
    element.child("name").fail("<name>: found '" + shown_text(algorithm.name) +
                               "', expected at most 64 letters, digits and '_', a letter first, other than '" +
                               kChosenCloud + "'");
  algorithm.program = element.text("program");
  for (const XmlElement& argument : element.children("argument")) algorithm.arguments.push_back(argument.text());
  if (algorithm.arguments.size() > kMostArguments)
    element.fail("<algorithm>: found more than 64 <argument>, expected no more");
  const std::string uses = element.text("uses");
  if (uses != "laser" && uses != "stereo")
    element.child("uses").fail("<uses>: found '" + shown_text(uses) + "', expected laser or stereo");
  algorithm.by_laser = uses == "laser";
  RunLimits& limits = algorithm.limits;
  limits.wall_s = element.number_or("timeLimit", limits.wall_s, kTime);
  limits.cpu_s = element.number_or("processorTimeLimit", limits.wall_s, kTime);
  limits.memory_bytes = bytes(element, "memoryLimit", limits.memory_bytes);
  limits.disk_bytes = bytes(element, "diskLimit", limits.disk_bytes);
  if (element.has("processLimit")) limits.processes = element.integer("processLimit", kProcesses);
  return algorithm;
}

std::vector<Algorithm> read_algorithms(const XmlElement& element) {
  element.expect({}, {"algorithm"});
  std::vector<Algorithm> algorithms;
  std::set<std::string> names;
  for (const XmlElement& child : element.children("algorithm")) {
    if (algorithms.size() == kMostAlgorithms) child.fail("found more than 32 algorithms, expected no more");
    algorithms.push_back(read_algorithm(child));
    if (!names.insert(algorithms.back().name).second)
      child.fail("<name>: found '" + algorithms.back().name + "' again, expected a name of its own for each algorithm");
  }
  return algorithms;
}

}  // namespace tankrig
