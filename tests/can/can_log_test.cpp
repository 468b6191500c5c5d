// The candump log: what others wrote is read without loss and written back byte for byte.
#include "drivers/can/can_log.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <random>

#include "core/input_error.hpp"
#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

std::string line_of(const CanLogEntry& entry) {
  std::string text;
  append_line(entry, text);
  return text;
}

std::string complaint(const std::string& line) {
  return message_of<InputError>([&] { parse_can_log_line(line, "bus.log", 7); });
}

TEST(CanLog, ReadsEveryKindOfFrame) {
  // As candump.c and lib.c of can-utils write them.
  CanLogEntry e = parse_can_log_line("(1436509052.249713) vcan0 044#2A366C2BBA");
  EXPECT_EQ(e.wall_ns, 1436509052'249713000);
  EXPECT_FALSE(e.nanoseconds);
  EXPECT_EQ(e.interface, "vcan0");
  EXPECT_EQ(e.frame.can_id, 0x044u);
  EXPECT_EQ(e.frame.len, 5);
  EXPECT_EQ(std::memcmp(e.frame.data, "\x2A\x36\x6C\x2B\xBA", 5), 0);

  e = parse_can_log_line("(1436509052.249713001) can12 1FFFFFFF#");
  EXPECT_TRUE(e.nanoseconds);
  EXPECT_EQ(e.wall_ns, 1436509052'249713001);
  EXPECT_EQ(e.frame.can_id, 0x1FFFFFFFu | CAN_EFF_FLAG);
  EXPECT_EQ(e.frame.len, 0);

  e = parse_can_log_line("(0000000001.000000) c 7FF#R");
  EXPECT_EQ(e.frame.can_id, 0x7FFu | CAN_RTR_FLAG);
  EXPECT_EQ(parse_can_log_line("(1.000000) c 00000123#R5").frame.len, 5);
  EXPECT_EQ(parse_can_log_line("(1.000000) c 00000123#R5").frame.can_id, 0x123u | CAN_EFF_FLAG | CAN_RTR_FLAG);

  e = parse_can_log_line("(1.000000) can0 20000204#0001000000000000");
  EXPECT_EQ(e.frame.can_id, CAN_ERR_FLAG | 0x204u);
  EXPECT_EQ(e.frame.data[1], 1);

  e = parse_can_log_line("(1.000000) can0 123##3" + std::string(128, 'A'));
  EXPECT_TRUE(e.fd);
  EXPECT_EQ(e.frame.flags, 3);
  EXPECT_EQ(e.frame.len, 64);

  e = parse_can_log_line("(1.000000)   can0 123#1122334455667788_F T");
  EXPECT_EQ(e.dlc, 15);
  EXPECT_EQ(e.direction, 'T');
  EXPECT_EQ(e.column, 6);
}

TEST(CanLog, LinesOfCandumpComeBackByteForByte) {
  for (const std::string& line : std::vector<std::string>{
           "(1436509052.249713) vcan0 044#2A366C2BBA", "(1436509052.249713001) can0 1FFFFFFF#0102030405060708",
           "(0000000000.000000) can0 000#", "(0000000000.000001)  can0 7FF#R", "(1700000000.999999) can0 00000000#R8",
           "(1700000000.000000) slcan-long-name 20000080#0000000000000000", "(1700000000.000000) can0 123##0",
           "(1700000000.000000) can0 12345678##5" + std::string(128, 'F'), "(1700000000.000000)        can0 123#00 R",
           "(1700000000.000000) can0 123#0011223344556677_9 T", "(1700000000.000000) can0 123#R8_E"})
    EXPECT_EQ(line_of(parse_can_log_line(line)), line);
}

TEST(CanLog, AnyFrameComesBackAsItWas) {
  constexpr unsigned kSeed = 5;
  std::mt19937_64 random(kSeed);
  std::printf("seed %u\n", kSeed);
  for (int i = 0; i < 100'000; ++i) {
    CanLogEntry e;
    e.nanoseconds = random() % 2;
    e.wall_ns = static_cast<std::int64_t>(random() % 9'000'000'000'000'000'000);
    if (!e.nanoseconds) e.wall_ns -= e.wall_ns % 1000;
    e.interface = random() % 2 ? "can0" : "vcan1234567890";
    if (random() % 4 == 0) e.column = static_cast<int>(e.interface.size() + 1 + random() % 9);
    e.fd = random() % 3 == 0;
    const std::uint32_t bits = static_cast<std::uint32_t>(random());
    switch (random() % 3) {
      case 0:
        e.frame.can_id = bits & CAN_SFF_MASK;
        break;
      case 1:
        e.frame.can_id = (bits & CAN_EFF_MASK) | CAN_EFF_FLAG;
        break;
      default:
        e.frame.can_id = (bits & CAN_ERR_MASK) | CAN_ERR_FLAG;
    }
    e.frame.len = static_cast<std::uint8_t>(random() % (e.fd ? 65 : 9));
    if (!e.fd && random() % 4 == 0) e.frame.can_id |= CAN_RTR_FLAG;
    if (e.fd) e.frame.flags = random() % 16;
    if (!(e.frame.can_id & CAN_RTR_FLAG))
      for (int k = 0; k < e.frame.len; ++k) e.frame.data[k] = static_cast<std::uint8_t>(random());
    if (!e.fd && e.frame.len == 8 && random() % 2) e.dlc = static_cast<std::uint8_t>(9 + random() % 7);
    if (random() % 4 == 0) e.direction = random() % 2 ? 'R' : 'T';
    const std::string line = line_of(e);
    ASSERT_TRUE(parse_can_log_line(line) == e) << line;
    ASSERT_EQ(line_of(parse_can_log_line(line)), line);
  }
}

TEST(CanLog, BadLinesAreRefusedWithFileAndLine) {
  const struct {
    std::string line, expected;
  } kTable[] = {{"", "bus.log:7: column 1: found '', expected '(' and a stamp"},
                {"1436509052.249713 can0 1#", "expected '('"},
                {"(x.249713) can0 123#", "expected seconds"},
                {"(99999999999.000000) can0 123#", "before the year 2262"},
                {"(9999999999.000000) can0 123#", "before the year 2262"},
                {"(1.24971) can0 123#", "six or nine digits"},
                {"(1.2497131) can0 123#", "six or nine digits"},
                {"(1.249713 can0 123#", "expected ')'"},
                {"(1.249713)can0 123#", "expected a space and an interface"},
                {"(1.249713) can0", "expected a space and a frame"},
                {"(1.249713) can0 12#", "3 or 8 hexadecimal digits"},
                {"(1.249713) can0 800#", "3 or 8 hexadecimal digits"},
                {"(1.249713) can0 FFFFFFFFF#", "3 or 8 hexadecimal digits"},
                {"(1.249713) can0 40000000#", "3 or 8 hexadecimal digits"},
                {"(1.249713) can0 123", "expected '#'"},
                {"(1.249713) can0 123#1", "pairs of digits, at most 8 bytes"},
                {"(1.249713) can0 123#112233445566778899", "at most 8 bytes"},
                {"(1.249713) can0 123##", "CAN FD flags"},
                {"(1.249713) can0 123##1" + std::string(130, '0'), "at most 64 bytes"},
                {"(1.249713) can0 123#R9", "a length of at most 8"},
                {"(1.249713) can0 123#11_9", "a length code 9 to F after eight bytes"},
                {"(1.249713) can0 123#11 X", "expected R or T"},
                {"(1.249713) can0 123#11 R ", "expected the end of the line"},
                {"(1.249713) can0 123#1.2", "pairs of digits"},
                {std::string("(1.249713) can0 123#11\x01", 23), R"(found '?)"}};
  for (const auto& row : kTable)
    EXPECT_NE(complaint(row.line).find(row.expected), std::string::npos)
        << row.line << "\n  gave:     " << complaint(row.line) << "\n  expected: " << row.expected;
}

TEST(CanLog, LineCutByACrashIsNoEntry) {
  const std::string whole = "(1.000000) can0 123#1122\n(2.000000) can0 124#3344\n";
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    const CanLog log = parse_can_log(whole.substr(0, cut));
    const std::size_t lines = cut == whole.size() ? 2 : cut >= 25 ? 1 : 0;
    EXPECT_EQ(log.entries.size(), lines) << cut;
    EXPECT_EQ(log.cut_bytes, cut - 25 * lines);
  }
}

TEST(CanLog, FileErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  const auto file = folder.write("bus.log", "(1.000000) can0 123#11\n(2.000000) can0 xyz\n");
  EXPECT_NE(message_of<InputError>([&] { read_can_log(file); }).find("bus.log:2: column 17: found"), std::string::npos);
  EXPECT_NE(message_of<InputError>([&] { read_can_log(folder.path() / "none"); }).find("cannot be read"),
            std::string::npos);
}

TEST(CanLog, RandomAndMutatedLinesNeverCrash) {
  constexpr unsigned kSeed = 6;
  std::mt19937 random(kSeed);
  std::printf("seed %u\n", kSeed);
  const std::string good[] = {"(1436509052.249713) vcan0 044#2A366C2BBA", "(1.000000001)  can0 1FFFFFFF##1AABBCC",
                              "(1700000000.000000) can0 20000204#0001000000000000 R", "(1.000000) c 123#R8_F"};
  int read = 0;
  for (int i = 0; i < 150'000; ++i) {
    std::string line;
    if (i % 3 == 0) {
      line.resize(random() % 60);
      for (char& c : line) c = static_cast<char>(random());
    } else {
      line = good[random() % std::size(good)];
      for (int k = random() % 3; k >= 0; --k) {
        const std::size_t at = random() % line.size();
        if (random() % 3 == 0)
          line.erase(at, 1);
        else if (random() % 2)
          line[at] = "0123456789ABCDEFRT#_() .x"[random() % 25];
        else
          line.insert(at, 1, static_cast<char>(random()));
        if (line.empty()) line = "(";
      }
    }
    try {
      const CanLogEntry e = parse_can_log_line(line);
      ++read;
      ASSERT_LE(e.frame.len, e.fd ? 64 : 8);
      ASSERT_TRUE(parse_can_log_line(line_of(e)) == e) << line;
    } catch (const InputError&) {
    }
  }
  EXPECT_GT(read, 1000);
}

TEST(CanLog, Log2ascOfCanUtilsReadsOurs) {
  if (std::system("command -v log2asc >/dev/null 2>&1") != 0) GTEST_SKIP() << "log2asc (can-utils) is not installed";
  const TemporaryFolder folder;
  CanLogEntry e;
  e.interface = "can0";
  std::string text;
  std::mt19937 random(8);
  std::vector<std::string> expected;
  for (int i = 0; i < 200; ++i) {
    e.wall_ns += 1'000'000;
    e.frame = {};
    e.frame.can_id = i % 2 ? random() & CAN_SFF_MASK : (random() & CAN_EFF_MASK) | CAN_EFF_FLAG;
    e.frame.len = i % 9;
    char id[16];
    std::snprintf(id, sizeof id, i % 2 ? "%X" : "%Xx", e.frame.can_id & CAN_EFF_MASK);
    std::string row = id;
    row += " d " + std::to_string(e.frame.len);
    for (int k = 0; k < e.frame.len; ++k) {
      e.frame.data[k] = static_cast<std::uint8_t>(random());
      char byte[4];
      std::snprintf(byte, sizeof byte, " %02X", e.frame.data[k]);
      row += byte;
    }
    expected.push_back(row);
    append_line(e, text);
    text += '\n';
  }
  const auto log = folder.write("can.log", text), asc = folder.path() / "can.asc";
  ASSERT_EQ(std::system(("log2asc -I '" + log.string() + "' -O '" + asc.string() + "' can0").c_str()), 0);
  // "   0.0010 1  123             Rx   d 2 11 22": compare what follows the channel, spaces and direction aside.
  std::stringstream rows(folder.read("can.asc"));
  std::string line;
  std::size_t row = 0;
  while (std::getline(rows, line)) {
    std::stringstream words(line);
    std::string time, channel, id, direction, rest, word;
    if (!(words >> time >> channel >> id >> direction) || direction != "Rx") continue;
    while (words >> word) rest += " " + word;
    ASSERT_LT(row, expected.size());
    EXPECT_EQ(id + rest, expected[row]) << line;
    ++row;
  }
  EXPECT_EQ(row, expected.size()) << folder.read("can.asc").substr(0, 400);
}

}  // namespace
}  // namespace tankrig
