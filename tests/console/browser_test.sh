#!/bin/sh
# browser_test.sh TEST RIG PROGRAM WEB [PATTERN]: TEST.mjs, or its tests whose names match, with the browser that is there; 77 with what is missing.
browser=
for name in chromium-headless-shell chromium; do
  if command -v "$name" >/dev/null; then browser=$(command -v "$name"); break; fi
done
command -v node >/dev/null || { echo "skipped: no node"; exit 77; }
[ -n "$browser" ] || { echo "skipped: no chromium"; exit 77; }
[ "$1" != users_test ] || command -v openssl >/dev/null || { echo "skipped: no openssl"; exit 77; }
exec node ${5:+"--test-name-pattern=$5"} "$(dirname "$0")/$1.mjs" "$2" "$3" "$4" "$browser"
