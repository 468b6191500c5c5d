# Of a LastTest.log of ctest: the tests that judged nothing because the machine was late, and by how much.
{ gsub(/\033\[[0-9;]*m/, "") }  # colours
/^[0-9]+\/[0-9]+ Testing: / { test = $3; for (i = 4; i <= NF; ++i) test = test " " $i; where = test }
/^\[ RUN      \] / { where = index(test, $4) ? test : test ", " $4 }
match($0, /skipped because the machine was late: by [0-9.]+ ms/) {
  by = substr($0, RSTART, RLENGTH)
  sub(/.*: /, "", by)
  what = substr($0, 1, RSTART - 1)
  late[++tests] = where ": " what by
}
END {
  printf "skipped because the machine was late: %d test%s\n", tests, tests == 1 ? "" : "s"
  for (i = 1; i <= tests; ++i) print "  " late[i]
}
