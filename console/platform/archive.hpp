// Archives: a stranger's, unpacked with care, and a dataset, packed.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tankrig {

struct ArchiveLimits {
  std::uint64_t bytes = 256ULL << 20;  ///< unpacked
  std::size_t entries = 2000;
};

/// Unpacks a .tar.gz (or .tar) into the empty folder `into`: files and folders alone, below it, each named once. Of a
/// file's mode the owner's right to execute is kept. Owners and times are not.
/// Errors: InputError naming what is refused: a link, a device, a name that leads outside, too much of anything, what
/// is damaged; then `into` holds a part.
void unpack_archive(const std::filesystem::path& archive, const std::filesystem::path& into,
                    const ArchiveLimits& limits = {});

/// Packs the regular files below `folder` as a .tar, whole or not at all, below a folder `name`.
/// Errors: InputError.
void pack_archive(const std::filesystem::path& folder, const std::string& name, const std::filesystem::path& archive);

}  // namespace tankrig
