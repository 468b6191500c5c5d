#!/bin/bash
# format.sh ROOT: every source is as clang-format 14 leaves it (.clang-format). Another version breaks lines elsewhere.
set -euo pipefail
command -v clang-format-14 >/dev/null || { echo "clang-format-14 is not installed (./run test installs it where apt can)"; exit 77; }
cd -- "$1"
find apps bench calibration console core drivers examples pipeline reconstruction rig session sim_backends tests -name '*.[ch]pp' -print0 |
  xargs -0 clang-format-14 --dry-run --Werror
