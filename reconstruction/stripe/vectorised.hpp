// Functions that the compiler makes three times: for every processor, and with the wider registers of AVX2 and of AVX-512.
#pragma once

#include <cstdint>

/// Before a function outside of classes whose loops the compiler can vectorise. Nothing is added up in another order and
/// nothing is contracted (-ffp-contract=off), so all give the same bits. Sanitizers and clang know one of them only.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define TANKRIG_VECTORISED __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define TANKRIG_VECTORISED
#endif

namespace tankrig {

/// GCC's and clang's own.
using FourFloats = float __attribute__((vector_size(16)));
/// In one register of AVX2, in two of an older processor.
using EightFloats = float __attribute__((vector_size(32)));
using FourDoubles = double __attribute__((vector_size(32)));
using FourLongs = std::int64_t __attribute__((vector_size(32)));  ///< what a comparison of FourDoubles gives
using EightInts = int __attribute__((vector_size(32)));           ///< what a comparison of them gives

}  // namespace tankrig
