// The arm's serial frames, from any stream of bytes.
#include <cstdlib>
#include <deque>

#include "drivers/arm/serial_frame.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  SerialDecoder decoder;
  std::deque<std::uint8_t> last;
  for (std::size_t i = 0; i < size; ++i) {
    last.push_back(bytes[i]);
    if (last.size() > kSerialFrameBytes) last.pop_front();
    if (!decoder.push(bytes[i])) continue;
    SerialFrame frame;
    if (last.size() != kSerialFrameBytes) std::abort();
    std::copy(last.begin(), last.end(), frame.begin());
    if (frame.front() != kStartOfFrame || frame.back() != kEndOfFrame) std::abort();
    if (!(decode_content(frame) == decoder.content())) std::abort();
    if (!(decode_content(encode(decoder.content())) == decoder.content())) std::abort();
  }
  const SerialDecoderCounters& c = decoder.counters();
  if (c.frames * kSerialFrameBytes + c.discarded_bytes > size) std::abort();
  return 0;
}
