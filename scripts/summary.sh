#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Sums up the results of ctest, failed and skipped tests by name, and ends with one line
# 'N passed, N failed, N skipped'.
#
#   scripts/summary.sh RESULTS.xml      (from ctest --output-junit)
#
# Skipped is a test that asked for it by a line 'SKIPPED: <reason>' (property SKIP_REGULAR_EXPRESSION) or by its exit
# code (SKIP_RETURN_CODE), or that is disabled. A test that could not be started failed, and so did a test with a failed
# assertion, whatever else it printed. Exit code 1 if a test failed, if none passed, or if there are no results.
set -euo pipefail
case "${1:-}" in
  -h | --help | '') sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
if [ ! -s "$1" ]; then
  echo "summary: ctest left no results"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
fi

awk '
function attribute(line, key) {
  if (!match(line, " " key "=\"[^\"]*\"")) return ""
  return plain(substr(line, RSTART + length(key) + 3, RLENGTH - length(key) - 4))
}
function plain(text) {
  gsub(/&lt;/, "<", text); gsub(/&gt;/, ">", text); gsub(/&quot;/, "\"", text); gsub(/&apos;/, "\047", text)
  gsub(/&amp;/, "\\&", text)
  return text
}
/<testcase / { name = attribute($0, "name"); status = attribute($0, "status"); reason = ""; asked = 0; broken = 0 }
/<skipped /  { reason = attribute($0, "message"); if (reason ~ /^SKIP_/) asked = 1 }
# The output of a test may begin on the line of its tag; angle brackets in it are escaped.
/SKIPPED: /  {
  if (status == "notrun") { reason = plain($0); sub(/.*SKIPPED: /, "", reason); sub(/<\/system-out>.*/, "", reason) }
}
/FAILED:/    { broken = 1 }
/<\/testcase>/ {
  if (status == "run") passed++
  else if ((status == "notrun" && asked && !broken) || status == "disabled") skipped_lines[++skipped] = name ": " reason
  else failed_lines[++failed] = name (status == "notrun" && !broken ? ": could not be run: " reason : "")
}
END {
  for (i = 1; i <= failed; i++) print "failed:  " failed_lines[i]
  for (i = 1; i <= skipped; i++) print "skipped: " skipped_lines[i]
  if (passed + failed == 0) { print "summary: no test ran"; failed = 1 }
  printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
  exit failed > 0
}' "$1"
