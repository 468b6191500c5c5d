#include "rig/guardian/guardian_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace tankrig {

GuardianMemory::GuardianMemory() : descriptor_(::memfd_create("tankrig-guardian", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (!descriptor_ || ::ftruncate(descriptor_.get(), sizeof(GuardianWords)) != 0 ||
      ::fcntl(descriptor_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw std::system_error(errno, std::generic_category(), "guardian: shared memory");
  map();
}

GuardianMemory::GuardianMemory(OwnedDescriptor descriptor) : descriptor_(std::move(descriptor)) { map(); }

GuardianMemory::~GuardianMemory() { ::munmap(words_, sizeof(GuardianWords)); }

/// Zero bytes are the words' beginning.
void GuardianMemory::map() {
  void* const at = ::mmap(nullptr, sizeof(GuardianWords), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_.get(), 0);
  if (at == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "guardian: shared memory");
  words_ = static_cast<GuardianWords*>(at);
}

}  // namespace tankrig
