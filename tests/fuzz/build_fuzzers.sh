#!/bin/bash
# build_fuzzers.sh SOURCE BUILD: the fuzz targets with clang, libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer.
set -euo pipefail
source=$1 build=$2

clang=$(command -v clang++ || true)
if [ -z "$clang" ]; then echo "SKIPPED: no clang++ (Debian package clang)"; exit 77; fi
if ! echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
  "$clang" -fsanitize=fuzzer,address -x c++ - -o /dev/null 2>/dev/null; then
  echo "SKIPPED: clang++ cannot link libFuzzer (Debian package libclang-rt-14-dev)"; exit 77
fi
launcher=()
if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTANKRIG_FUZZ=ON -DCMAKE_C_COMPILER=clang \
  -DCMAKE_CXX_COMPILER=clang++ "${launcher[@]}"
export CCACHE_BASEDIR=$source CCACHE_NOHASHDIR=1
exec ninja -C "$build" -j "$(nproc)" fuzzers
