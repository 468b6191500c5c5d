#include "console/platform/archive.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

// POSIX.1-1988 ustar: fields of a block, by offset and length.
constexpr std::size_t kBlock = 512, kSum = 148, kType = 156;
struct Field {
  std::size_t at, length;
};
constexpr Field kName{0, 100}, kMode{100, 8}, kSize{124, 12}, kPrefix{345, 155};
constexpr std::uint64_t kMostExtension = 64 << 10;  // bytes of a long name or of pax records
constexpr std::size_t kLongestName = 512, kDeepest = 16;

using Block = std::array<char, kBlock>;

std::string_view text_of(const Block& block, Field field) {
  const std::string_view all(block.data() + field.at, field.length);
  return all.substr(0, std::min(all.find('\0'), all.size()));
}

/// The sum of its bytes with those of the sum taken for blanks.
unsigned sum_of(const Block& block) {
  unsigned sum = 0;
  for (std::size_t i = 0; i < kBlock; ++i)
    sum += i >= kSum && i < kSum + 8 ? ' ' : static_cast<unsigned char>(block[i]);
  return sum;
}

class Archive {
 public:
  explicit Archive(const fs::path& file)
      : file_(::gzdopen(open_regular_file(file, UINT64_MAX >> 1, "an archive"), "rb"), &::gzclose) {
    if (!file_) throw InputError("archive: cannot be opened");
  }
  /// False at its end.
  bool read(Block& block) {
    const int n = ::gzread(file_.get(), block.data(), kBlock);
    if (n == 0 && ::gzeof(file_.get())) return false;
    if (n != static_cast<int>(kBlock)) throw InputError("archive: is cut short or damaged, expected a .tar.gz");
    return true;
  }
  std::string read_extension(std::uint64_t size) {
    if (size > kMostExtension)
      throw InputError(fmt::format("archive: a name or record of {} bytes, expected at most {}", size, kMostExtension));
    std::string text;
    for (Block block; text.size() < size && read(block);) text.append(block.data(), kBlock);
    if (text.size() < size) throw InputError("archive: is cut short, expected more of a long name");
    text.resize(size);
    return text;
  }

 private:
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
};

std::uint64_t octal(const Block& block, Field field, const char* what) {
  std::string_view text = text_of(block, field);
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  std::uint64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value, 8);
  if (failure != std::errc{} || end != text.data() + text.size())
    throw InputError(fmt::format("archive: {} '{}', expected an octal number", what, shown_text(text)));
  return value;
}

/// The path of pax records, "LENGTH KEY=VALUE\n" each; empty if there is none.
std::string pax_path(std::string_view records) {
  std::string path;
  while (!records.empty()) {
    std::size_t length = 0;
    const auto [end, failure] = std::from_chars(records.data(), records.data() + records.size(), length);
    const auto digits = static_cast<std::size_t>(end - records.data());
    if (failure != std::errc{} || length > records.size() || length < digits + 3 || *end != ' ' ||
        records[length - 1] != '\n')
      throw InputError("archive: its pax records are damaged");
    const std::string_view record = records.substr(digits + 1, length - digits - 2);
    if (record.starts_with("path=")) path = record.substr(5);
    for (const char* refused : {"size=", "linkpath=", "GNU.sparse"})
      if (record.starts_with(refused))
        throw InputError(fmt::format("archive: a pax record '{}', expected plain files", refused));
    records.remove_prefix(length);
  }
  return path;
}

/// `name` without "." and what it must not have.
fs::path safe_path(const std::string& name) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("archive: '{}' {}", shown_text(name), why));
  };
  if (name.size() > kLongestName) refuse(fmt::format("is longer than {} bytes", kLongestName));
  if (find_unprintable(name) != std::string::npos || name.find('\n') != std::string::npos)
    refuse("has characters that no name here has");
  if (!stays_inside(name)) refuse("leads outside of the archive");
  fs::path path;
  for (const fs::path& part : fs::path(name))
    if (part != "." && !part.empty()) path /= part;
  if (std::distance(path.begin(), path.end()) > static_cast<std::ptrdiff_t>(kDeepest))
    refuse(fmt::format("lies deeper than {} folders", kDeepest));
  return path;
}

const char* kind_of(char type) {
  switch (type) {
    case '1':
      return "a hard link";
    case '2':
      return "a symbolic link";
    case '3':
    case '4':
      return "a device";
    case '6':
      return "a pipe";
    default:
      return "of a kind that is not known here";
  }
}

void make_folder(const fs::path& folder, const std::string& name) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem) throw InputError("archive: '" + shown_text(name) + "': " + problem.message());
}

void write_file(Archive& archive, const fs::path& file, const fs::path& name, std::uint64_t size, bool executable) {
  const int descriptor =
      ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, executable ? 0755 : 0644);
  if (descriptor < 0 && errno == EEXIST)
    throw InputError("archive: '" + shown_text(name.string()) + "' is in it twice");
  if (descriptor < 0) throw CannotWrite(file, errno);
  const std::unique_ptr<const int, void (*)(const int*)> closed(&descriptor, [](const int* d) { ::close(*d); });
  for (Block block; size > 0;) {
    if (!archive.read(block)) throw InputError("archive: is cut short in '" + shown_text(name.string()) + "'");
    std::string_view bytes(block.data(), std::min<std::uint64_t>(size, kBlock));
    size -= bytes.size();
    write_all(file, descriptor, bytes);
  }
}

}  // namespace

void unpack_archive(const fs::path& file, const fs::path& into, const ArchiveLimits& limits) {
  Archive archive(file);
  std::uint64_t bytes = 0;
  std::size_t entries = 0, blocks = 0;
  std::string long_name;
  // Blocks that hold no file are bounded with the entries: an archive of nothing but records ends too.
  for (Block block; archive.read(block);) {
    if (std::ranges::all_of(block, [](char c) { return c == 0; })) break;
    if (octal(block, {kSum, 8}, "a sum") != sum_of(block))
      throw InputError(blocks == 0 ? "archive: is no tar archive, expected a .tar.gz" : "archive: is damaged");
    if (++blocks > 4 * limits.entries)
      throw InputError(
          fmt::format("archive: more than {} entries, expected at most {}", limits.entries, limits.entries));
    const char type = block[kType];
    const std::uint64_t size = octal(block, kSize, "a size");
    if (type == 'x' || type == 'L' || type == 'g') {
      const std::string text = archive.read_extension(size);
      if (type == 'L') long_name = text.substr(0, text.find('\0'));
      if (type == 'x') long_name = pax_path(text);
      continue;
    }
    std::string name(text_of(block, kName));
    if (const std::string_view prefix = text_of(block, kPrefix);
        !prefix.empty() && std::string_view(block.data() + 257, 6) == std::string_view("ustar\0", 6))
      name = std::string(prefix) + "/" + name;
    if (!long_name.empty()) name = std::exchange(long_name, {});
    if (type != '0' && type != '\0' && type != '5')
      throw InputError(fmt::format("archive: '{}' is {}, expected files and folders", shown_text(name), kind_of(type)));
    if (++entries > limits.entries)
      throw InputError(fmt::format("archive: more than {} entries, expected at most that", limits.entries));
    const fs::path path = safe_path(name);
    if (type == '5' || name.ends_with('/')) {
      if (size != 0) throw InputError("archive: a folder with bytes in it: it is damaged");
      make_folder(into / path, name);
      continue;
    }
    if (path.empty()) throw InputError("archive: a file without a name");
    if (size > limits.bytes || (bytes += size) > limits.bytes)
      throw InputError(fmt::format("archive: more than {} MiB unpacked, expected at most that", limits.bytes >> 20));
    make_folder((into / path).parent_path(), name);
    write_file(archive, into / path, path, size, octal(block, kMode, "a mode") & 0100);
  }
  if (entries == 0) throw InputError("archive: is empty, expected a .tar.gz with a program");
}

void pack_archive(const fs::path& folder, const std::string& name, const fs::path& archive) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder));
  std::ranges::sort(files);
  UnfinishedFile out(archive);
  const auto write = [&](std::string_view bytes) { write_all(archive, out.descriptor(), bytes); };
  for (const fs::path& file : files) {
    const std::string bytes = read_regular_file(folder / file, most_table_bytes(), "a file to pack");
    const std::string inside = name + "/" + file.generic_string();
    if (inside.size() >= kName.length) throw InputError(folder / file, "a name too long for an archive");
    Block block{};
    const auto put = [&](std::size_t at, const std::string& text) {
      std::ranges::copy(text, block.begin() + static_cast<std::ptrdiff_t>(at));
    };
    put(kName.at, inside);
    put(kMode.at, "0000644");
    put(108, "0000000");
    put(116, "0000000");
    put(kSize.at, fmt::format("{:011o}", bytes.size()));
    put(136, "00000000000");
    block[kType] = '0';
    put(257, std::string("ustar\0"
                         "00",
                         8));
    put(kSum, fmt::format("{:06o}", sum_of(block)) + std::string("\0 ", 2));
    write({block.data(), kBlock});
    write(bytes);
    write(std::string((kBlock - bytes.size() % kBlock) % kBlock, '\0'));
  }
  write(std::string(2 * kBlock, '\0'));
  out.put_in_place_durably();
}

}  // namespace tankrig
