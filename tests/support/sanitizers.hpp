// What a build with sanitizers changes for a test: what it cannot see there, and how much longer things take.
#pragma once

#include <gtest/gtest.h>

#if defined(__SANITIZE_ADDRESS__)
#define TANKRIG_ADDRESS_SANITIZER 1
#elif defined(__SANITIZE_THREAD__)
#define TANKRIG_THREAD_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TANKRIG_ADDRESS_SANITIZER 1
#elif __has_feature(thread_sanitizer)
#define TANKRIG_THREAD_SANITIZER 1
#endif
#endif

#if defined(TANKRIG_ADDRESS_SANITIZER) || defined(TANKRIG_THREAD_SANITIZER)
#define TANKRIG_SANITIZED 1
/// Ends a test that no sanitizer's build can run.
#define TANKRIG_SKIP_SANITIZED(reason) GTEST_SKIP() << "under a sanitizer: " << reason
#else
#define TANKRIG_SANITIZED 0
#define TANKRIG_SKIP_SANITIZED(reason) static_cast<void>(0)
#endif

namespace tankrig::testing_support {

/// How many times longer a program may take: a factor for bounds of the wall clock.
inline constexpr int kSlowness = TANKRIG_SANITIZED ? 10 : 1;

inline constexpr char kNoCounting[] = "it has an allocator of its own, so none can be counted";

}  // namespace tankrig::testing_support
