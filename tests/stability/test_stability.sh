#!/bin/sh
# The short version of every sweep, and whether the table and the headers say what the csv files hold.
#   All steps and the figures: make stability
cd "$(dirname "$0")/../.." || exit 1
status=0
for method in direct bem hao; do
    build/tests/stability/$method || status=1
done
sh tests/stability/limits.sh --check || status=1
exit $status
