#!/bin/sh
# Copies the common block of sss_dipole.h, markers included, into every other sss_*.h; touches nothing else.
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed -n '/^\/\/ ---- BEGIN sss common block/,/^\/\/ ---- END sss common block/p' sss_dipole.h >"$work/block"
[ -s "$work/block" ] || { echo "sync.sh: sss_dipole.h has no common block" >&2; exit 1; }
for header in sss_*.h; do
    [ "$header" = sss_dipole.h ] && continue
    begins=$(grep -c '^// ---- BEGIN sss common block' "$header" || true)
    ends=$(grep -c '^// ---- END sss common block' "$header" || true)
    [ "$begins $ends" = "1 1" ] || { echo "sync.sh: $header lacks the two markers" >&2; exit 1; }
    awk -v block="$work/block" '
        /^\/\/ ---- BEGIN sss common block/ { while ((getline line < block) > 0) print line; inside = 1 }
        !inside
        /^\/\/ ---- END sss common block/ { inside = 0 }' "$header" >"$work/header"
    if cmp -s "$work/header" "$header"; then continue; fi
    cat "$work/header" >"$header"
    echo "sync.sh: $header updated"
done
