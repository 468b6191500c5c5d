// Processors that do not fall asleep deeply, so that a thread that keeps time does not wait for one to wake.
#pragma once

namespace tankrig {

/// Where the kernel takes requests for its processors' latency (its admin-guide/pm/cpuidle).
inline constexpr char kLatencyRequests[] = "/dev/cpu_dma_latency";

/// While it lives, no processor enters a sleep state that takes time to leave: a request for latency 0, which the
/// kernel forgets with its file. Does nothing where the file may not be written.
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
