#!/bin/bash
# Runs one test program inside the guest:  guest_test.sh PROGRAM [GTEST FILTER].  What the host may skip must run here:
# a case skipped, or no case at all, is a failure. Exit status 0 or 1.
set -uo pipefail
program=$1 filter=${2-}
log=$(mktemp)
if [[ -n $filter ]]; then
  "$program" --gtest_filter="$filter" 2>&1 | tee "$log" || { echo "guest: $program: exit status ${PIPESTATUS[0]}"; exit 1; }
  if grep -q '\[  SKIPPED \]' "$log"; then echo "guest: a case that must run here was skipped"; exit 1; fi
  grep -qE '\[  PASSED  \] [1-9][0-9]* test' "$log" || { echo "guest: no case matches $filter"; exit 1; }
else
  "$program" || { echo "guest: $program: exit status $?"; exit 1; }
fi
