#!/bin/sh
# The short version of every sweep.      All steps and the figure: make stability
cd "$(dirname "$0")/../.." || exit 1
exec build/tests/stability/hao
