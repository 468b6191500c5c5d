// Parts of tankrig that stand on hundreds of libraries few runs need: loaded when they are first called.
#pragma once

namespace tankrig {

/// The object `symbol` in lib/tankrig/`file`. What is loaded stays loaded.
/// Threads: any. RT: never.
/// Errors: InputError with what the loader says.
const void* module_symbol(const char* file, const char* symbol);

}  // namespace tankrig
