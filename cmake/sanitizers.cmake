# The build's sanitizers. What is suppressed, and why: tests/sanitizers/, docs/reference/testing.md.
if(TANKRIG_FUZZ)
  # -O0: half of the compiling, which is most of what seconds of fuzzing cost.
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -O0)
  add_link_options(-fsanitize=address,undefined)
elseif(TANKRIG_SANITIZE STREQUAL "address")
  # Without the checks of every pointer, a quarter of the compiling: the fuzzers have them.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize=alignment,nonnull-attribute,null,object-size,pointer-overflow,returns-nonnull-attribute,vptr
    -fno-sanitize-recover=undefined -fno-omit-frame-pointer -O1)
  add_link_options(-fsanitize=address,undefined)
elseif(TANKRIG_SANITIZE STREQUAL "thread")
  add_compile_options(-fsanitize=thread -fno-omit-frame-pointer -O1)
  add_link_options(-fsanitize=thread)
  # Threads that the sanitizer sees, instead of oneTBB's.
  include_directories(BEFORE ${PROJECT_SOURCE_DIR}/tests/sanitizers/thread)
elseif(TANKRIG_SANITIZE)
  message(FATAL_ERROR "TANKRIG_SANITIZE: found ${TANKRIG_SANITIZE}, expected address, thread or nothing")
endif()
if(TANKRIG_FUZZ OR TANKRIG_SANITIZE)
  # A sanitizer opens modules in our place: found by a run path that holds for the whole program, not for whom asks.
  add_link_options(-Wl,--disable-new-dtags)
endif()
