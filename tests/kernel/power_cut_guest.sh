#!/bin/bash
# What power_cut.sh runs in its guests:  end TEST | check TEST | record TEST MOMENT | verify TEST HANDED_OVER WAS_LATE
set -euo pipefail
here=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")" && pwd)
what=$1 program=$2
echo 0 >/proc/sys/vm/dirty_writeback_centisecs   # the kernel writes nothing unasked
if [[ $what == end || $what == record ]]; then mkfs.ext4 -q /dev/vda; fi
export CUT_SESSION=/mnt/session
mount -t ext4 -o commit=300 /dev/vda /mnt
case $what in
  end)
    "$program" --gtest_filter='CutRecording.EndsAndIsSealed'
    echo "ended with 0"
    sleep 100
    ;;
  check) exec "$here/guest_test.sh" "$program" 'CutRecording.IsWholeIfItHadEnded' ;;
  record) CUT_AFTER_S=$3 "$program" --gtest_filter='CutRecording.RunsUntilTheSupplyGoes' ;;
  verify)
    export CUT_HANDED_OVER=$3 CUT_WAS_LATE=$4
    exec "$here/guest_test.sh" "$program" 'CutRecording.LostAtMostItsLastSecond'
    ;;
esac
