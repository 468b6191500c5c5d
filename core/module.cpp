#include "core/module.hpp"

#include <dlfcn.h>

#include <string>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

[[noreturn]] void fail(const char* file) {
  const char* why = ::dlerror();
  throw InputError(std::string("a part of tankrig, lib/tankrig/") + file + ", cannot be loaded: " +
                   (why != nullptr ? why : "nobody says why") + "; expected it where tankrig is installed");
}

}  // namespace

const void* module_symbol(const char* file, const char* symbol) {
  void* const module = ::dlopen(file, RTLD_NOW | RTLD_LOCAL);  // found by the run path of the program
  if (module == nullptr) fail(file);
  const void* const found = ::dlsym(module, symbol);
  if (found == nullptr) fail(file);
  return found;
}

}  // namespace tankrig
