#include "drivers/can/can_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>
#include <optional>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr int kLongestName = 64;  // interfaces have at most 15 characters; foreign tools write more

void put_hex(std::string& text, std::uint32_t value, int digits) {
  for (int i = digits - 1; i >= 0; --i) text += "0123456789ABCDEF"[value >> 4 * i & 0xF];
}

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

/// Reads a line from left to right. What does not fit is an InputError that shows where.
class LineReader {
 public:
  LineReader(std::string_view line, const std::filesystem::path& file, int number)
      : line_(line), file_(file), number_(number) {}

  [[noreturn]] void fail(const std::string& expected) const {
    std::string found(line_.substr(std::min(at_, line_.size()), 20));
    for (char& c : found)
      if (!std::isprint(static_cast<unsigned char>(c))) c = '?';
    throw InputError(file_, number_, fmt::format("column {}: found '{}', expected {}", at_ + 1, found, expected));
  }

  bool done() const { return at_ == line_.size(); }
  char peek() const { return done() ? '\0' : line_[at_]; }
  bool take(char c) {
    if (done() || line_[at_] != c) return false;
    ++at_;
    return true;
  }
  void expect(char c, const std::string& what) {
    if (!take(c)) fail(what);
  }

  /// `count` is the number of digits read.
  std::int64_t decimal(int most, int& count, const std::string& what) {
    std::int64_t value = 0;
    for (count = 0; std::isdigit(static_cast<unsigned char>(peek())) && count < most; ++count, ++at_)
      value = value * 10 + (peek() - '0');
    if (count == 0) fail(what);
    return value;
  }

  std::optional<std::uint8_t> hex_digit() {
    const int value = done() ? -1 : hex_value(line_[at_]);
    if (value < 0) return std::nullopt;
    ++at_;
    return static_cast<std::uint8_t>(value);
  }

  /// Bytes as pairs of digits, at most `most`.
  std::uint8_t bytes(std::uint8_t* into, int most, const std::string& what) {
    int n = 0;
    while (const auto high = hex_digit()) {
      const auto low = hex_digit();
      if (!low || n == most) fail(what);
      into[n++] = static_cast<std::uint8_t>(*high << 4 | *low);
    }
    return static_cast<std::uint8_t>(n);
  }

  int spaces() {
    int n = 0;
    while (take(' ')) ++n;
    return n;
  }

  std::string word(const std::string& what) {
    const std::size_t begin = at_;
    while (!done() && std::isgraph(static_cast<unsigned char>(peek())) && at_ - begin < kLongestName) ++at_;
    if (at_ == begin) fail(what);
    return std::string(line_.substr(begin, at_ - begin));
  }

 private:
  std::string_view line_;
  const std::filesystem::path& file_;
  int number_;
  std::size_t at_ = 0;
};

void read_stamp(LineReader& in, CanLogEntry& entry) {
  in.expect('(', "'(' and a stamp");
  int digits = 0;
  const std::int64_t whole = in.decimal(10, digits, "seconds");
  if (whole > INT64_MAX / kNsPerSecond - 1) in.fail("seconds before the year 2262");
  in.expect('.', "'.' and a fraction of a second");
  const std::int64_t fraction = in.decimal(9, digits, "six or nine digits");
  if (digits != 6 && digits != 9) in.fail("six or nine digits");
  entry.nanoseconds = digits == 9;
  entry.wall_ns = whole * kNsPerSecond + fraction * (entry.nanoseconds ? 1 : 1000);
  in.expect(')', "')'");
}

void read_id(LineReader& in, canfd_frame& frame) {
  const char* what = "an identifier of 3 or 8 hexadecimal digits";
  std::uint32_t id = 0;
  int digits = 0;
  while (digits <= 8) {
    const auto digit = in.hex_digit();
    if (!digit) break;
    id = id << 4 | *digit;
    ++digits;
  }
  if (digits == 3 && id <= CAN_SFF_MASK) {
    frame.can_id = id;
  } else if (digits == 8 && (id & CAN_ERR_FLAG) && !(id & ~(CAN_ERR_FLAG | CAN_ERR_MASK))) {
    frame.can_id = id;
  } else if (digits == 8 && id <= CAN_EFF_MASK) {
    frame.can_id = id | CAN_EFF_FLAG;
  } else {
    in.fail(what);
  }
}

void read_remote(LineReader& in, canfd_frame& frame) {
  frame.can_id |= CAN_RTR_FLAG;
  if (const auto length = in.hex_digit()) {
    if (*length > CAN_MAX_DLEN) in.fail("a length of at most 8");
    frame.len = *length;
  }
}

/// "_9" to "_F": the data length code of an eight-byte frame.
void read_raw_dlc(LineReader& in, CanLogEntry& entry) {
  if (!in.take('_')) return;
  const auto dlc = in.hex_digit();
  if (!dlc || *dlc <= CAN_MAX_DLEN || entry.frame.len != CAN_MAX_DLEN)
    in.fail("a length code 9 to F after eight bytes");
  entry.dlc = *dlc;
}

void read_payload(LineReader& in, CanLogEntry& entry) {
  in.expect('#', "'#'");
  if (in.take('#')) {
    entry.fd = true;
    const auto flags = in.hex_digit();
    if (!flags) in.fail("CAN FD flags, one digit");
    entry.frame.flags = *flags;
    entry.frame.len = in.bytes(entry.frame.data, CANFD_MAX_DLEN, "pairs of digits, at most 64 bytes");
    return;
  }
  if (in.take('R'))
    read_remote(in, entry.frame);
  else
    entry.frame.len = in.bytes(entry.frame.data, CAN_MAX_DLEN, "pairs of digits, at most 8 bytes");
  read_raw_dlc(in, entry);
}

}  // namespace

bool operator==(const CanLogEntry& a, const CanLogEntry& b) {
  return a.wall_ns == b.wall_ns && a.nanoseconds == b.nanoseconds && a.interface == b.interface &&
         a.column == b.column && a.fd == b.fd && a.dlc == b.dlc && a.direction == b.direction &&
         std::memcmp(&a.frame, &b.frame, sizeof a.frame) == 0;
}

void append_line(const CanLogEntry& entry, std::string& text) {
  const canfd_frame& f = entry.frame;
  const std::int64_t whole = entry.wall_ns / kNsPerSecond, rest = entry.wall_ns % kNsPerSecond;
  if (entry.nanoseconds)
    fmt::format_to(std::back_inserter(text), "({:010}.{:09}) ", whole, rest);
  else
    fmt::format_to(std::back_inserter(text), "({:010}.{:06}) ", whole, rest / 1000);
  if (entry.column > static_cast<int>(entry.interface.size())) text.append(entry.column - entry.interface.size(), ' ');
  text += entry.interface;
  text += ' ';

  if (f.can_id & CAN_ERR_FLAG)
    put_hex(text, f.can_id & (CAN_ERR_FLAG | CAN_ERR_MASK), 8);
  else if (f.can_id & CAN_EFF_FLAG)
    put_hex(text, f.can_id & CAN_EFF_MASK, 8);
  else
    put_hex(text, f.can_id & CAN_SFF_MASK, 3);
  text += '#';

  const bool remote = (f.can_id & CAN_RTR_FLAG) && !entry.fd;
  if (remote) {
    text += 'R';
    if (f.len > 0) put_hex(text, f.len, 1);
  } else {
    if (entry.fd) {
      text += '#';
      put_hex(text, f.flags, 1);
    }
    const int most = entry.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN;
    for (int i = 0; i < std::min<int>(f.len, most); ++i) put_hex(text, f.data[i], 2);
  }
  if (entry.dlc > CAN_MAX_DLEN) {
    text += '_';
    put_hex(text, entry.dlc, 1);
  }
  if (entry.direction) {
    text += ' ';
    text += entry.direction;
  }
}

CanLogEntry parse_can_log_line(std::string_view line, const std::filesystem::path& file, int number) {
  LineReader in(line, file, number);
  CanLogEntry entry;
  read_stamp(in, entry);
  const int spaces = in.spaces();
  if (spaces == 0) in.fail("a space and an interface");
  entry.interface = in.word("an interface");
  if (spaces > 1) entry.column = spaces - 1 + static_cast<int>(entry.interface.size());
  in.expect(' ', "a space and a frame");
  read_id(in, entry.frame);
  read_payload(in, entry);
  if (in.take(' ')) {
    entry.direction = in.peek();
    if (!in.take('R') && !in.take('T')) in.fail("R or T");
  }
  if (!in.done()) in.fail("the end of the line");
  return entry;
}

CanLog parse_can_log(std::string_view text, const std::filesystem::path& file) {
  CanLog log;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) {
      log.cut_bytes = text.size();
      break;
    }
    log.entries.push_back(parse_can_log_line(text.substr(0, end), file, number));
    text.remove_prefix(end + 1);
  }
  return log;
}

CanLog read_can_log(const std::filesystem::path& file) {
  return parse_can_log(read_regular_file(file, most_table_bytes(), "a CAN log"), file);
}

}  // namespace tankrig
