// Runs a fuzz target over its corpus, and over the corpus cut short at every byte, without a fuzzer.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

int main(int argc, char** argv) {
  constexpr std::size_t kCuts = 400;  // of one file; of a longer one not every byte
  std::size_t inputs = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      const std::vector<char> text{std::istreambuf_iterator<char>(in), {}};
      std::vector<std::uint8_t> bytes(text.begin(), text.end());
      const std::size_t step = std::max<std::size_t>(1, bytes.size() / kCuts);
      LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
      for (std::size_t cut = 0; cut < bytes.size(); cut += step) {
        const std::vector<std::uint8_t> head(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut));
        LLVMFuzzerTestOneInput(head.data(), head.size());
      }
      ++inputs;
    }
  }
  std::printf("%zu inputs, and each cut short at up to %zu places\n", inputs, kCuts);
  return inputs > 0 ? 0 : 1;
}
