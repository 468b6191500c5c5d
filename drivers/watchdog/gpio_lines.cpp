#include "drivers/watchdog/gpio_lines.hpp"

#include <fmt/format.h>
#include <gpiod.h>

#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr char kConsumer[] = "tankrig";

struct CloseChip {
  void operator()(gpiod_chip* chip) const noexcept { gpiod_chip_close(chip); }  // with its lines
};

/// A line that nobody else uses.
class GpioLine {
 public:
  GpioLine(const GpioPlace& place, const std::string& key)
      : where_("safety: " + key + ": " + place.chip), number_(place.line), chip_(gpiod_chip_open(place.chip.c_str())) {
    if (!chip_)
      throw InputError(
          fmt::format("{}: {}, expected a GPIO chip: gpiodetect lists them", where_, std::strerror(errno)));
    const unsigned lines = gpiod_chip_num_lines(chip_.get());
    if (static_cast<unsigned>(place.line) >= lines)
      throw InputError(
          fmt::format("{}: found line {}, expected 0 to {}", where_, number_, static_cast<int>(lines) - 1));
    line_ = gpiod_chip_get_line(chip_.get(), static_cast<unsigned>(place.line));
    if (!line_) refuse();
  }

  /// `requested`: of a gpiod_line_request_...; 0 if it was granted.
  void require(int requested) {
    if (requested != 0) refuse();
  }
  gpiod_line* get() const noexcept { return line_; }

 private:
  [[noreturn]] void refuse() {
    const int problem = errno;
    const char* const user = problem == EBUSY && line_ ? gpiod_line_consumer(line_) : nullptr;
    throw InputError(fmt::format("{}: line {}: {}{}, expected one that is free: gpioinfo lists them", where_, number_,
                                 std::strerror(problem), user ? std::string(", used by ") + user : ""));
  }

  const std::string where_;
  const int number_;
  const std::unique_ptr<gpiod_chip, CloseChip> chip_;
  gpiod_line* line_ = nullptr;  // the chip's
};

class GpioHeartbeat final : public HeartbeatLine {
 public:
  GpioHeartbeat(const GpioPlace& place, const std::string& key) : line_(place, key) {
    line_.require(gpiod_line_request_output(line_.get(), kConsumer, 0));
  }
  Status edge() noexcept override {
    on_ = !on_;
    if (gpiod_line_set_value(line_.get(), on_ ? 1 : 0) == 0) return {};
    return Error{ErrorCode::kDisconnected, errno, {}, "watchdog box: heartbeat"};
  }

 private:
  GpioLine line_;
  bool on_ = false;
};

class GpioEnable final : public EnableLine {
 public:
  GpioEnable(const GpioPlace& place, bool closed_is_on, const std::string& key)
      : line_(place, key), closed_is_on_(closed_is_on) {
    const int pull = closed_is_on ? GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN : GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
    line_.require(gpiod_line_request_input_flags(line_.get(), kConsumer, pull));
  }
  Result<std::optional<bool>> read() noexcept override {
    const int level = gpiod_line_get_value(line_.get());
    if (level < 0) return Error{ErrorCode::kDisconnected, errno, {}, "watchdog box: enable input"};
    return std::optional<bool>((level == 1) == closed_is_on_);
  }

 private:
  GpioLine line_;
  const bool closed_is_on_;
};

}  // namespace

std::shared_ptr<HeartbeatLine> open_gpio_heartbeat(const GpioPlace& place, const std::string& key) {
  return std::make_shared<GpioHeartbeat>(place, key);
}

std::shared_ptr<EnableLine> open_gpio_enable(const GpioPlace& place, bool closed_is_on, const std::string& key) {
  return std::make_shared<GpioEnable>(place, closed_is_on, key);
}

}  // namespace tankrig
