#!/bin/sh
# Whether two runs of the chart on one machine have the same front within the noise that they show.
#      tests/chart/compare.sh A.csv B.csv
# In each case, what is on the front of one file must not be beaten beyond the noise in the other: by a run that is no
# farther from the reference and whose slowest frame is quicker than its quickest. Errors must agree within 1 %, which
# no clock excuses. Says what differs, and how much quicker the second file is. Status 1 where a front differs.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
awk -F, -f "$here/front.awk" -f "$here/compare.awk" "$1" "$2"
