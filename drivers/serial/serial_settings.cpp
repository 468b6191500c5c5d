#include "drivers/serial/serial_settings.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <libserial/SerialPort.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <optional>
#include <utility>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

using LibSerial::BaudRate;
using enum LibSerial::BaudRate;

constexpr std::array<std::pair<int, BaudRate>, 26> kBauds{
    {{50, BAUD_50},           {110, BAUD_110},         {300, BAUD_300},         {600, BAUD_600},
     {1200, BAUD_1200},       {1800, BAUD_1800},       {2400, BAUD_2400},       {4800, BAUD_4800},
     {9600, BAUD_9600},       {19200, BAUD_19200},     {38400, BAUD_38400},     {57600, BAUD_57600},
     {115200, BAUD_115200},   {230400, BAUD_230400},   {460800, BAUD_460800},   {500000, BAUD_500000},
     {576000, BAUD_576000},   {921600, BAUD_921600},   {1000000, BAUD_1000000}, {1152000, BAUD_1152000},
     {1500000, BAUD_1500000}, {2000000, BAUD_2000000}, {2500000, BAUD_2500000}, {3000000, BAUD_3000000},
     {3500000, BAUD_3500000}, {4000000, BAUD_4000000}}};

std::optional<BaudRate> known_baud(int baud) {
  for (const auto& [rate, code] : kBauds)
    if (rate == baud) return code;
  return std::nullopt;
}

/// libserial's destructor throws, and so ends the program, if the device went while it was open.
struct CloseOrAbandon {
  void operator()(LibSerial::SerialPort* line) const noexcept {
    try {
      if (line->IsOpen()) line->Close();
    } catch (...) {
      try {
        ::close(line->GetFileDescriptor());
      } catch (...) {
      }
      return;  // not deleted
    }
    delete line;
  }
};

using Line = std::unique_ptr<LibSerial::SerialPort, CloseOrAbandon>;

Line configured(const SerialSettings& settings, bool whole_bytes) {
  using namespace LibSerial;
  Line line(new LibSerial::SerialPort);
  line->Open(settings.device);
  ::fcntl(line->GetFileDescriptor(), F_SETFD, FD_CLOEXEC);
  line->SetBaudRate(*known_baud(settings.baud));
  line->SetFlowControl(FlowControl::FLOW_CONTROL_NONE);
  line->SetStopBits(settings.stop_bits == 2 ? StopBits::STOP_BITS_2 : StopBits::STOP_BITS_1);
  line->SetVMin(0);
  line->SetVTime(0);
  if (whole_bytes) return line;
  constexpr CharacterSize kSizes[] = {CharacterSize::CHAR_SIZE_5, CharacterSize::CHAR_SIZE_6,
                                      CharacterSize::CHAR_SIZE_7, CharacterSize::CHAR_SIZE_8};
  line->SetCharacterSize(kSizes[settings.data_bits - 5]);
  line->SetParity(settings.parity == 'E'   ? Parity::PARITY_EVEN
                  : settings.parity == 'O' ? Parity::PARITY_ODD
                                           : Parity::PARITY_NONE);
  return line;
}

}  // namespace

void check_serial_settings(const SerialSettings& s) {
  if (!known_baud(s.baud))
    throw InputError(fmt::format("{}: baud is {}, expected a standard rate, e.g. 9600 or 115200", s.device, s.baud));
  if (s.data_bits < 5 || s.data_bits > 8)
    throw InputError(fmt::format("{}: data bits are {}, expected 5 to 8", s.device, s.data_bits));
  if (s.parity != 'N' && s.parity != 'E' && s.parity != 'O')
    throw InputError(fmt::format("{}: parity is '{}', expected N, E or O", s.device, s.parity));
  if (s.stop_bits < 1 || s.stop_bits > 2)
    throw InputError(fmt::format("{}: stop bits are {}, expected 1 or 2", s.device, s.stop_bits));
}

bool is_pseudo_terminal(int fd) noexcept {
  struct stat status {};
  if (::fstat(fd, &status) != 0) return false;
  const unsigned major_number = major(status.st_rdev);
  return major_number >= 136 && major_number <= 143;
}

int set_serial_line(int fd, const SerialSettings& settings) try {
  const bool whole_bytes = is_pseudo_terminal(fd);
  const Line line = configured(settings, whole_bytes);
  termios chosen{};
  if (::tcgetattr(fd, &chosen) != 0) return errno;
  if (::cfgetospeed(&chosen) != static_cast<speed_t>(*known_baud(settings.baud)))
    throw InputError(fmt::format("{} does not know {} baud: expected a rate that adapter and device share",
                                 settings.device, settings.baud));
  // libserial has damaged bytes and breaks left out: what is around them would pass for an answer.
  chosen.c_iflag = settings.parity != 'N' && !whole_bytes ? INPCK : 0;
  line->Close();  // restores what it found
  return ::tcsetattr(fd, TCSANOW, &chosen) == 0 ? 0 : errno;
} catch (const InputError&) {
  throw;
} catch (const std::exception& e) {
  throw InputError(fmt::format("{} cannot be set to {} baud, {}{}{}: {}", settings.device, settings.baud,
                               settings.data_bits, settings.parity, settings.stop_bits, e.what()));
}

}  // namespace tankrig
