// Keeps processors out of deep sleep, so that a time-critical thread does not wait for one to wake.
#pragma once

namespace tankrig {

/// Where the kernel takes requests for its processors' latency (its admin-guide/pm/cpuidle).
inline constexpr char kLatencyRequests[] = "/dev/cpu_dma_latency";

/// While it lives, no processor enters a sleep state that takes time to leave: a request for latency 0, which the
/// kernel drops when its file is closed. Does nothing if the file is not writable.
class CpuLatencyRequest {
 public:
  CpuLatencyRequest() noexcept;
  ~CpuLatencyRequest();
  CpuLatencyRequest(const CpuLatencyRequest&) = delete;
  CpuLatencyRequest& operator=(const CpuLatencyRequest&) = delete;

  bool held() const noexcept { return request_ >= 0; }

 private:
  int request_;
};

}  // namespace tankrig
