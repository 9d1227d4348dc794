#!/bin/sh
# What sss_dipole_needs chooses, against every run of the chart: see tests/chart/choice/main.c.
cd "$(dirname "$0")/../.." || exit 1
exec build/tests/chart/choice
