#!/bin/bash
# run_tests.sh PROCESSES PROGRAM [OPTION...]: runs a googletest program once for all its cases, dealt to that many processes side by
# side, and prints what each said. GTEST_FILTER chooses cases. Exit status 77: every case was skipped.
set -uo pipefail
processes=$1
shift
said=$(mktemp -d)
trap 'rm -rf "$said"' EXIT
running=() code=0
for ((i = 0; i < processes; ++i)); do
  GTEST_TOTAL_SHARDS=$processes GTEST_SHARD_INDEX=$i "$@" >"$said/$i" 2>&1 &
  running[i]=$!
done
for ((i = 0; i < processes; ++i)); do
  wait "${running[i]}" || { echo "$1: exit status $?" >>"$said/$i"; code=1; }
  cat "$said/$i"
done
if [ $code = 0 ] && grep -qs '^\[  SKIPPED \]' "$said"/* && ! grep -qs '^\[  PASSED  \] [1-9]' "$said"/*; then exit 77; fi
exit $code
