#!/bin/bash
# run_fuzzer.sh BUILD NAME CORPUS SECONDS: one fuzzer for a bounded time, from CORPUS alone, with the seed TANKRIG_SEED (1).
# New inputs go to BUILD/found/NAME, which is emptied first; an input that breaks the parser is kept in BUILD/broken/NAME:
# its name is printed, and the exit code is 1 (libFuzzer's own would be 77: skipped).
set -euo pipefail
build=$1 name=$2 corpus=$3 seconds=$4 seed=${TANKRIG_SEED:-1}

fuzzer=$(find "$build" -name "fuzz_$name" -type f -perm -u+x -print -quit 2>/dev/null || true)
if [ -z "$fuzzer" ]; then echo "SKIPPED: the fuzzers were not built (see fuzz.build)"; exit 77; fi
found=$build/found/$name broken=$build/broken/$name
rm -rf "$found"
mkdir -p "$found" "$broken"
echo "fuzz_$name for $seconds s; TANKRIG_SEED=$seed"
exec "$fuzzer" -seed="$seed" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -max_len=65536 -print_final_stats=1 -verbosity=0 -error_exitcode=1 -timeout_exitcode=1 \
  -artifact_prefix="$broken/" "$found" "$corpus"
