// Benchmark files.
#include "bench/benchmark/benchmark.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("benchmark.xml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const Benchmark benchmark = read_benchmark(file);
    for (const std::size_t point : {std::size_t{0}, benchmark.points() - 1}) (void)benchmark.values(point);
  });
}
