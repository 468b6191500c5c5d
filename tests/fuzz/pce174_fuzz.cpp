// A PCE-174's answers, from any bytes.
#include <cmath>
#include <cstdlib>

#include "drivers/lux/pce174_protocol.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto live = decode_pce174_live({bytes, size});
  if (!live.ok()) return 0;
  if (size != kPce174LiveBytes || !std::isfinite(live.value().lux())) std::abort();
  if (live.value().counts < 0 || live.value().counts > 9999) std::abort();
  return 0;
}
