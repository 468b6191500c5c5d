#include "tests/watchdog/fake_gpiod.hpp"

#include <gpiod.h>

#include <cerrno>
#include <cstring>

using tankrig::testing_support::fake_gpio_chip;
using tankrig::testing_support::FakeGpioLine;

namespace tankrig::testing_support {

FakeGpioChip& fake_gpio_chip() {
  static FakeGpioChip chip;
  return chip;
}

namespace {

FakeGpioLine& of(gpiod_line* line) { return *reinterpret_cast<FakeGpioLine*>(line); }

int request(gpiod_line* line, bool output, int flags) {
  FakeGpioLine& it = of(line);
  if (!it.user.empty() || it.requested) return errno = EBUSY, -1;
  it.requested = true;
  it.output = output;
  it.flags = flags;
  return 0;
}

}  // namespace
}  // namespace tankrig::testing_support

using namespace tankrig::testing_support;

extern "C" {

gpiod_chip* gpiod_chip_open(const char* path) {
  if (std::strcmp(path, "/dev/gpiochip7") != 0) return errno = ENOENT, nullptr;
  ++fake_gpio_chip().open;
  return reinterpret_cast<gpiod_chip*>(&fake_gpio_chip());
}
void gpiod_chip_close(gpiod_chip*) {
  --fake_gpio_chip().open;
  for (FakeGpioLine& line : fake_gpio_chip().lines) line.requested = false;
}
unsigned int gpiod_chip_num_lines(gpiod_chip*) { return static_cast<unsigned>(fake_gpio_chip().lines.size()); }
gpiod_line* gpiod_chip_get_line(gpiod_chip*, unsigned int offset) {
  return reinterpret_cast<gpiod_line*>(&fake_gpio_chip().lines.at(offset));
}
const char* gpiod_line_consumer(gpiod_line* line) { return of(line).user.empty() ? nullptr : of(line).user.c_str(); }
int gpiod_line_request_output(gpiod_line* line, const char*, int) { return request(line, true, 0); }
int gpiod_line_request_input_flags(gpiod_line* line, const char*, int flags) { return request(line, false, flags); }
int gpiod_line_set_value(gpiod_line* line, int value) {
  if (of(line).fails) return errno = ENODEV, -1;
  of(line).written.push_back(value);
  return 0;
}
int gpiod_line_get_value(gpiod_line* line) {
  if (of(line).fails) return errno = ENODEV, -1;
  return of(line).level;
}
}
