// SHA256SUMS: what `session check` holds a session against.
#include <algorithm>
#include <sstream>

#include "core/input_error.hpp"
#include "session/checking/checksums.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  constexpr std::uint8_t kText[] = "stamp_ns\n";
  folder.put("joints.csv", kText, sizeof kText - 1);
  folder.put("SHA256SUMS", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const auto differences = compare_checksums(folder.path());
    const bool listed = std::none_of(differences.begin(), differences.end(), [](const ChecksumDifference& d) {
      return d.file == "joints.csv" && d.kind == ChecksumDifference::Kind::kNotListed;
    });
    std::istringstream lines(std::string(reinterpret_cast<const char*>(bytes), size));
    bool expected = false;
    for (std::string line; std::getline(lines, line);) expected = expected || line.substr(66) == "joints.csv";
    if (listed != expected) std::abort();
    write_checksums(folder.path());  // what was sealed keeps its sum, the rest gets one
    for (const ChecksumDifference& d : compare_checksums(folder.path()))
      if (d.kind == ChecksumDifference::Kind::kNotListed) std::abort();
  });
}
