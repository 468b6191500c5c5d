// The proof test of a relay that opens by itself when nobody commands it any more.
#pragma once

#include <optional>

#include "core/time.hpp"

namespace tankrig {

/// Threads: any.
class RelayProof {
 public:
  virtual ~RelayProof() = default;

  /// While they are withheld, an on that the relay has taken is not sent again. Its contacts are read as ever, and off is
  /// sent as ever. True forgets what an earlier proof has measured.
  virtual void withhold_refreshes(bool withheld) noexcept = 0;
  /// From the last on to the contact read back open, though on was commanded, the interlock closed and the refreshes
  /// withheld. Nothing: that was not seen.
  virtual std::optional<Duration> opened_by_itself() const noexcept = 0;
};

}  // namespace tankrig
