// Segments of a session's spool. The first byte says whether the sums of the records are set right first: a fuzzer does
// not guess a CRC-32, and what lies behind one must be safe too.
#include <cstdlib>
#include <string>
#include <string_view>

#include "core/input_error.hpp"
#include "core/session_names.hpp"
#include "session/checking/crc32.hpp"
#include "session/reading/session_tables.hpp"
#include "session/recording/spool.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

namespace {

constexpr std::string_view kMagic = "TANKFRM1";
constexpr std::size_t kHeader = 40;

std::uint64_t u32_at(std::string_view bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void put_u32(std::string& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(value >> 8 * i & 0xff);
}

void set_sums_right(std::string& bytes) {
  for (std::size_t at = 0; (at = bytes.find(kMagic, at)) != std::string::npos && at + kHeader <= bytes.size();) {
    const std::string_view all = bytes, record = all.substr(at);
    const std::uint64_t line = u32_at(record, 16), pixels = u32_at(record, 20) * u32_at(record, 24) % (1 << 20),
                        body = line + pixels * (u32_at(record, 28) % 4);
    if (body <= record.size() - kHeader) put_u32(bytes, at + 32, crc32(record.substr(kHeader, body)));
    put_u32(bytes, at + 36, crc32(std::string_view(bytes).substr(at, 36)));
    at += kHeader;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  if (size == 0) return 0;
  std::string text(reinterpret_cast<const char*>(bytes + 1), size - 1);
  if (bytes[0] == 's') set_sums_right(text);
  const auto file = folder.put("000000.raw", reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  return fuzzing::refused_or_parsed<InputError>([&] {
    const SpoolSegment segment(file);
    std::uint64_t accounted = segment.stray_bytes();
    for (const SpooledFrame& frame : segment.frames()) {
      const std::uint64_t pixels = frame.image.total() * frame.image.elemSize();
      accounted += kHeader + frame.line.size() + pixels;
      (void)crc32({reinterpret_cast<const char*>(frame.image.data), pixels});  // reads them all
      if (const auto record = parse_frames_line(frame.line))
        if (!is_picture_name(record->file, record->camera)) std::abort();
    }
    if (accounted != text.size()) std::abort();  // every byte belongs to one record, or is stray
  });
}
