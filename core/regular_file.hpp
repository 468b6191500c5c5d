// Files from others, read whole: regular ones of bounded size. Pipes, devices and endless files are refused, not waited
// for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tankrig {

// The most bytes read from a file of each kind: far above any good file, far below a machine's memory.
inline constexpr std::uint64_t kMostYamlBytes = 4U << 20;       ///< thousands are usual; parsed they take a hundredfold
inline constexpr std::uint64_t kMostSceneBytes = 16 << 20;      ///< thousands are usual
inline constexpr std::uint64_t kMostPictureBytes = 512U << 20;  ///< 80 megapixels of 3 x 16 bits, uncompressed
inline constexpr std::uint64_t kMostMeshBytes = 1ULL << 30;     ///< twenty million triangles
inline constexpr std::uint64_t kMostCloudBytes = 4ULL << 30;    ///< a hundred million points

/// The same for a table or a log, which grows with the scan: half of this machine's memory, but at least 2 GiB. An hour
/// of joints at 1 kHz is 1 GiB.
std::uint64_t most_table_bytes();

/// Opens `file` for reading; the caller closes it.
/// Errors: InputError if it cannot be read, is no regular file, or has more than `most` bytes; `expected` is what the
/// message says was expected.
int open_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected);

/// All of `file`.
/// Errors: as open_regular_file().
std::string read_regular_file(const std::filesystem::path& file, std::uint64_t most, const std::string& expected);

/// The same for a descriptor that open(2) gave for `file`, or -1. Closes it.
std::string read_regular_file(int descriptor, const std::filesystem::path& file, std::uint64_t most,
                              const std::string& expected);

/// Flags for an open(2) that does not wait for the other end of a pipe.
extern const int kReadWithoutWaiting;

}  // namespace tankrig
