#!/bin/bash
# Runs one test program inside the guest:  guest_test.sh PROGRAM GTEST_FILTER  or  guest_test.sh PROGRAM --OPTION...
# What the host may skip must run here: a case skipped, or no case at all, is a failure. Exit status 0 or 1.
set -uo pipefail
program=$1
shift
export TANKRIG_SERIAL_LINES=/dev/ttyS1:/dev/ttyS2  # wired crosswise by rigvm.sh
if [[ ${1---} == --* ]]; then
  "$program" "$@" || { echo "guest: $program: exit status $?"; exit 1; }
  exit 0
fi
log=$(mktemp)
"$program" --gtest_filter="$1" 2>&1 | tee "$log" || { echo "guest: $program: exit status ${PIPESTATUS[0]}"; exit 1; }
if grep -q '\[  SKIPPED \]' "$log"; then echo "guest: a case that must run here was skipped"; exit 1; fi
grep -qE '\[  PASSED  \] [1-9][0-9]* test' "$log" || { echo "guest: no case matches $1"; exit 1; }
