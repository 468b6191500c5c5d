// oneTBB's parallel_for for builds with ThreadSanitizer, which cannot see how the library hands tasks over: threads of
// our own do the work instead, so that it sees every order there is and every race between two bodies.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tbb {
namespace instead {

/// body(0) ... body(count - 1) by up to four threads; the first exception is thrown again when all have ended.
template <class Body>
void run(std::size_t count, const Body& body) {
  const std::size_t allowed = global_control::active_value(global_control::max_allowed_parallelism);
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) body(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t n = 1; n < std::min({count, allowed, std::size_t{4}}); ++n) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace instead

template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body) {
  if (first < last)
    instead::run(static_cast<std::size_t>(last - first),
                 [&](std::size_t i) { body(static_cast<Index>(first + static_cast<Index>(i))); });
}

template <class Value, class Body>
void parallel_for(const blocked_range<Value>& range, const Body& body) {
  const std::size_t grain = range.grainsize();
  instead::run((range.size() + grain - 1) / grain, [&](std::size_t i) {
    const Value begin = range.begin() + static_cast<Value>(i * grain);
    body(blocked_range<Value>(begin, begin + static_cast<Value>(std::min(grain, range.size() - i * grain)), grain));
  });
}

}  // namespace tbb
