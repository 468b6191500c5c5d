#!/bin/bash
# run_tests.sh PROCESSES ALONE PROGRAM [OPTION...]: runs a googletest program once for all its cases, dealt to that many processes side by
# side, and prints what each said. The cases of the filter ALONE run before, one after the other, unless it is empty. GTEST_FILTER chooses
# cases, all of them to be dealt. Exit status 77: every case was skipped.
set -uo pipefail
processes=$1 alone=$2
shift 2
said=$(mktemp -d)
trap 'rm -rf "$said"' EXIT
running=() code=0
failed() { echo "$1: exit status $2" >>"$3"; code=1; }
if [ -n "$alone" ] && [ -z "${GTEST_FILTER-}" ]; then
  GTEST_FILTER=$alone "$@" >"$said/alone" 2>&1 || failed "$1" $? "$said/alone"
  cat "$said/alone"
  export GTEST_FILTER=-$alone
fi
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
