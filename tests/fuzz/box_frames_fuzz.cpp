// What a watchdog box and the program send each other, from any bytes that may come.
#include <cstdlib>

#include "drivers/watchdog/box_frames.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  BoxReader replies(kReplyLead), beats(kBeatLead);
  std::size_t found = 0;
  for (std::size_t i = 0; i < size; ++i) {
    for (BoxReader* reader : {&replies, &beats}) {
      const auto message = reader->take(data[i]);
      if (!message) continue;
      ++found;
      const std::uint8_t lead = reader == &replies ? kReplyLead : kBeatLead;
      const BoxFrame frame = encode_box(lead, *message);
      if (frame[3] != data[i] || frame[2] != data[i - 1]) std::abort();  // the bytes that have just come
    }
  }
  if (4 * found > size) std::abort();
  return 0;
}
