#!/bin/bash
# run_tests.sh PROCESSES OTHERS PROGRAM [OPTION...]: runs a googletest program once for all its cases but those of the filter OTHERS, dealt to
# that many processes side by side, and prints what each said. GTEST_FILTER chooses cases instead, of all. Exit status 77: every case was skipped.
set -uo pipefail
processes=$1 others=$2
shift 2
said=$(mktemp -d)
trap 'rm -rf "$said"' EXIT
running=() code=0
failed() { echo "$1: exit status $2" >>"$3"; code=1; }
if [ -n "$others" ] && [ -z "${GTEST_FILTER-}" ]; then export GTEST_FILTER=-$others; fi
for ((i = 0; i < processes; ++i)); do
  GTEST_TOTAL_SHARDS=$processes GTEST_SHARD_INDEX=$i "$@" >"$said/$i" 2>&1 &
  running[i]=$!
done
for ((i = 0; i < processes; ++i)); do
  wait "${running[i]}" || failed "$1" $? "$said/$i"
  cat "$said/$i"
done
if [ $code = 0 ] && grep -qs '^\[  SKIPPED \]' "$said"/* && ! grep -qs '^\[  PASSED  \] [1-9]' "$said"/*; then exit 77; fi
exit $code
