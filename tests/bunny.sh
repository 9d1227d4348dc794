#!/bin/sh
# Converts the bunny of Debian's glmark2-data to GLB and checks that nothing was lost.      tests/bunny.sh OUT.glb
set -eu
out=$1
source=/usr/share/glmark2/models/bunny.obj
for need in "$source" "$(command -v gltfpack || echo gltfpack)"; do
    [ -e "$need" ] || { echo "bunny.sh: $need is missing; run: sh tests/setup.sh demo" >&2; exit 1; }
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
gltfpack -noq -v -i "$source" -o "$work/bunny.glb" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }

# The counts that gltfpack reports on its output, against those of the OBJ.
want_triangles=$(grep -c '^f ' "$source")
want_vertices=$(grep '^v ' "$source" | sort -u | wc -l)
got=$(sed -n 's/^output: .*(\([0-9]*\) triangles, \([0-9]*\) vertices).*/\1 \2/p' "$work/log")
if [ "$got" != "$want_triangles $want_vertices" ] || [ "$want_triangles" != 69666 ]; then
    echo "bunny.sh: triangles and vertices are '$got', not '$want_triangles $want_vertices' (69666 triangles)" >&2
    exit 1
fi
mv "$work/bunny.glb" "$out"
