#include "apps/tankrig/bench/run_cost.hpp"

#include <sys/resource.h>

#include <initializer_list>

namespace tankrig::app {
namespace {

rusage use_of(__rusage_who who) {
  rusage use{};
  ::getrusage(who, &use);
  return use;
}

double time_of(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

}  // namespace

double processor_s() {
  double sum = 0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    const rusage use = use_of(who);
    sum += time_of(use.ru_utime) + time_of(use.ru_stime);
  }
  return sum;
}

double peak_mib() { return static_cast<double>(use_of(RUSAGE_SELF).ru_maxrss) / 1024; }

}  // namespace tankrig::app
