#include "core/cpu_latency_request.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>

namespace tankrig {

CpuLatencyRequest::CpuLatencyRequest() noexcept : request_(::open(kLatencyRequests, O_WRONLY | O_CLOEXEC)) {
  const std::int32_t latency_us = 0;
  if (!held() || ::write(request_, &latency_us, sizeof latency_us) == sizeof latency_us) return;
  ::close(request_);
  request_ = -1;
}

CpuLatencyRequest::~CpuLatencyRequest() {
  if (held()) ::close(request_);
}

}  // namespace tankrig
