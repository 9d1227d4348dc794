#!/bin/sh
# Hostile input at both doors: model_load under the address and undefined-behaviour sanitizers, and the command line
# of build/bake, which must answer with a message, exit status 2, and no output file.
cd "$(dirname "$0")/../.." || exit 1
: "${CC:=cc}" "${CXX:=c++}"

work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
mkdir "$work/refused" "$work/out"
passed=0 failed=0

check() # condition's status, what
{
    if [ "$1" = 0 ]; then passed=$((passed + 1)); echo "ok    $2"
    else failed=$((failed + 1)); echo "FAIL  $2"; fi
}

# ---- the loader ----

sanitize="-g -O1 -I. -fsanitize=address,undefined -fno-sanitize-recover=undefined"
if $CC -std=c99 $sanitize -c tests/fuzz/hostile_glb.c -o "$work/hostile_glb.o" &&
    $CXX -std=c++17 $sanitize -c examples/common/model.cpp -o "$work/model.o" &&
    $CXX $sanitize "$work/hostile_glb.o" "$work/model.o" -ltinygltf -lm -o "$work/hostile_glb"; then
    timeout 300 "$work/hostile_glb" "$work/refused" >"$work/log" 2>&1
    status=$?
    cat "$work/log"
    set -- $(sed -n 's/^\([0-9]*\) passed, \([0-9]*\) failed$/\1 \2/p' "$work/log")
    passed=$((passed + ${1:-0})) failed=$((failed + ${2:-0}))
    [ $status = 0 ]
    check $? "the loader survives everything under the sanitizers (exit status $status)"
else
    check 1 "the loader builds with the sanitizers"
fi

# ---- the command line ----

scattering="--material marble --size-mm 20"
sun="--light 1,1,1"
to="--out $work/out/a.glb --png $work/out/a.png --dump $work/out/a.f32 --dump-irradiance $work/out/e.f32"

refused() # what, arguments...
{
    what=$1
    shift
    timeout 60 build/bake "$@" >"$work/stdout" 2>"$work/stderr"
    status=$?
    left=$(ls -A "$work/out")
    [ $status = 2 ] && [ -s "$work/stderr" ] && [ -z "$left" ]
    check $? "bake refuses $what: status $status, '$(head -n 1 "$work/stderr")'${left:+, left $left}"
    rm -f "$work"/out/*
}

for hostile in "$work"/refused/*.glb; do
    refused "$(basename "$hostile" .glb)" "$hostile" $scattering $sun $to
done

# A tetrahedron that is good, to refuse the rest of the command line for: what a file named read_*.glb holds.
good=$work/good.gltf
cat >"$good" <<'END'
{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
"buffers":[{"byteLength":60,"uri":
"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAIBAAEDAAMCAQID"
}]}
END
printf 'short' >"$work/short.f32"
head -c 48 /dev/zero | tr '\000' '\377' >"$work/nan.f32"
: >"$work/empty.glb"

timeout 60 build/bake "$good" $scattering $sun $to --report >"$work/stdout" 2>"$work/stderr"
status=$?
[ $status = 0 ] && [ "$(ls "$work/out" | wc -l)" = 4 ] && [ "$(wc -c <"$work/out/a.f32")" = 48 ] &&
    grep -q '^vertices=4$' "$work/stdout" && grep -q '^triangles=4$' "$work/stdout"
check $? "bake takes the good file and writes all four outputs (status $status)"
rm -f "$work"/out/*

refused "a missing file" "$work/none.glb" $scattering $sun $to
refused "an empty file" "$work/empty.glb" $scattering $sun $to
refused "a directory" "$work" $scattering $sun $to
refused "a device" /dev/zero $scattering $sun $to
refused "no input" $scattering $sun $to
refused "two inputs" "$good" "$good" $scattering $sun $to
refused "no material" "$good" --size-mm 20 $sun $to
refused "an unknown material" "$good" --material granite --size-mm 20 $sun $to
refused "two materials" "$good" $scattering --albedo 0.5 --mfp 1 $sun $to
refused "half a material" "$good" --size-mm 20 --albedo 0.5 $sun $to
refused "an albedo above 1" "$good" --size-mm 20 --albedo 1.5 --mfp 1 $sun $to
refused "a negative coefficient" "$good" --size-mm 20 --sigma-s=-1 --sigma-a 1 $sun $to
refused "two numbers for three" "$good" --size-mm 20 --sigma-s 1,2 --sigma-a 1 $sun $to
refused "an eta of 0" "$good" $scattering --eta 0 $sun $to
refused "no light" "$good" $scattering $to
refused "a light without direction" "$good" $scattering --light 0,0,0 $to
refused "a light of two numbers" "$good" $scattering --light 1,1 $to
refused "a negative light" "$good" $scattering --light 1,1,1,-1,0,0 $to
refused "nothing to do" "$good" $scattering $sun
refused "an unknown option" "$good" $scattering $sun $to --fast
refused "an option without value" "$good" $scattering $sun $to --threads
refused "an unknown method" "$good" $scattering $sun $to --method magic
refused "a size of 0" "$good" --material marble --size-mm 0 $sun $to
refused "a size that is no number" "$good" --material marble --size-mm 5cm $sun $to
refused "an infinite size" "$good" --material marble --size-mm inf $sun $to
refused "two scales" "$good" $scattering --mm-per-unit 3 $sun $to
refused "a tolerance of 0" "$good" $scattering $sun $to --tolerance 0
refused "0 threads" "$good" $scattering $sun $to --threads 0
refused "half a thread" "$good" $scattering $sun $to --threads 1.5
refused "a picture of 0 pixels" "$good" $scattering $sun $to --resolution 0x10
refused "an unknown geometry" "$good" $scattering $sun $to --geometry flat
refused "an unknown exit" "$good" $scattering $sun $to --exit none
refused "a missing irradiance" "$good" $scattering --irradiance "$work/none.f32" $to
refused "a short irradiance" "$good" $scattering --irradiance "$work/short.f32" $to
refused "an irradiance that is not finite" "$good" $scattering --irradiance "$work/nan.f32" $to
refused "two outputs of one name" "$good" $scattering $sun --out "$work/out/x" --png "$work/out/x"
refused "an output folder that is not there" "$good" $scattering $sun $to --dump "$work/none/a.f32"
refused "an output that is a folder" "$good" $scattering $sun --dump "$work"

echo "$passed passed, $failed failed"
[ $failed = 0 ]
