// Files that others made, read whole: regular ones of a bounded size. A pipe, a device and what never ends are refused,
// not waited for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tankrig {

// The most bytes of a file of each kind that are read: far above any good one, far below a machine's memory.
inline constexpr std::uint64_t kMostYamlBytes = 4U << 20;       ///< thousands are usual; parsed they take a hundredfold
inline constexpr std::uint64_t kMostSceneBytes = 16 << 20;      ///< thousands are usual
inline constexpr std::uint64_t kMostPictureBytes = 512U << 20;  ///< 80 megapixels of 3 x 16 bits, uncompressed
inline constexpr std::uint64_t kMostMeshBytes = 1ULL << 30;     ///< twenty million triangles
inline constexpr std::uint64_t kMostCloudBytes = 4ULL << 30;    ///< a hundred million points

/// The same of a table or a log, which grows with the scan: what fits into half of this machine's memory, and 2 GiB on
/// any. An hour of joints at 1 kHz is 1 GiB.
std::uint64_t most_table_bytes();

/// `file` opened for reading; its end is the caller's: close().
/// Errors: InputError if it cannot be read, is no regular file, or has more than `most` bytes; `expected` is what the
/// message says was expected.
int open_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected);

/// All of `file`.
/// Errors: as open_regular_file().
std::string read_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected);

/// The same of a descriptor that open(2) gave for `file`, or of -1. Closes it.
std::string read_regular_file(int descriptor, const std::filesystem::path& file, std::uint64_t most,
                              const std::string& expected);

/// Flags for an open(2) that waits for nobody at the other end of a pipe.
extern const int kReadWithoutWaiting;

}  // namespace tankrig
