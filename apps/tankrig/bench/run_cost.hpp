// What a run has cost this machine, in figures that do not depend on what else runs on it.
#pragma once

namespace tankrig::app {

/// Processor time so far, of this process and of the programs that it has run [s].
double processor_s();

/// The most memory that this process has had [MiB].
double peak_mib();

}  // namespace tankrig::app
