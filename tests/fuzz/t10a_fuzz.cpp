// A T-10A's answers, from any bytes.
#include <cmath>
#include <cstdlib>

#include "drivers/lux/t10a_protocol.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto reply = decode_t10a_short({bytes, size});
  if (reply.ok() && size != kT10aShortBytes) std::abort();
  const auto measured = decode_t10a_measurement({bytes, size});
  if (!measured.ok()) return 0;
  if (size != kT10aLongBytes) std::abort();
  if (measured.value().value && !std::isfinite(*measured.value().value)) std::abort();
  return 0;
}
