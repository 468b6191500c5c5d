#include "core/thread_priority.hpp"

#include <pthread.h>
#include <sched.h>

namespace tankrig {

bool keep_time(const char* name, int priority) noexcept {
  pthread_setname_np(pthread_self(), name);
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

}  // namespace tankrig
