#!/bin/sh
# browser_test.sh TESTS RIG PROGRAM WEB [PATTERN]: each of TESTS, one or more with + between them, as TEST.mjs, side by side, or its tests whose
# names match, with the browser that is there; 77 with what is missing, or where one of them skipped and none failed.
browser=
for name in chromium-headless-shell chromium; do
  if command -v "$name" >/dev/null; then browser=$(command -v "$name"); break; fi
done
command -v node >/dev/null || { echo "skipped: no node"; exit 77; }
[ -n "$browser" ] || { echo "skipped: no chromium"; exit 77; }
case $1 in *users_test*) command -v openssl >/dev/null || { echo "skipped: no openssl"; exit 77; } ;; esac
said=$(mktemp -d)
trap 'rm -rf "$said"' EXIT
tests=$(echo "$1" | tr + ' ')
for test in $tests; do
  { node ${5:+"--test-name-pattern=$5"} "$(dirname "$0")/$test.mjs" "$2" "$3" "$4" "$browser" >"$said/$test" 2>&1; echo $? >"$said/$test.code"; } &
done
wait
code=0
for test in $tests; do
  cat "$said/$test"
  case $(cat "$said/$test.code") in
    0) ;;
    77) [ $code = 0 ] && code=77 ;;
    *) code=1 ;;
  esac
done
exit $code
