// A GPIO chip in this process, in place of libgpiod's: its functions are defined here, so the program's calls end here.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace tankrig::testing_support {

struct FakeGpioLine {
  std::string user;  ///< of somebody else; empty: free
  bool requested = false, output = false, fails = false;
  int level = 0, flags = 0;
  std::vector<int> written;
};

/// /dev/gpiochip7; every other is absent.
struct FakeGpioChip {
  std::array<FakeGpioLine, 4> lines{};
  int open = 0;
};
FakeGpioChip& fake_gpio_chip();

}  // namespace tankrig::testing_support
