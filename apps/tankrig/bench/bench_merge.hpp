// `tankrig bench merge`: the results of shards as those of one run.
#pragma once

#include "apps/tankrig/command_line/command_line.hpp"

namespace tankrig::app {

void add_bench_merge(CLI::App* bench, ChosenCommand& chosen);

}  // namespace tankrig::app
