#!/bin/sh
# Fuzzes every parser of bytes: each tests/fuzz/fuzz_NAME.c, with clang's libFuzzer under the address and
# undefined-behaviour sanitizers, for SSS_FUZZ_SECONDS (default 12) or a thousand inputs, whichever takes longer, from
# seeds that are valid files. An input that crashes is kept in build/fuzz. And a parser that does read one byte too far
# must be found.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
seconds=${SSS_FUZZ_SECONDS:-12}
out=build/fuzz
mkdir -p $out
have clang || { echo "clang is not installed"; echo "0 passed, 1 failed"; exit 1; }
sanitizers="-g1 -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=undefined"
# Memory is limited and the standard library's exceptions are the loader's own business.
options="-rss_limit_mb=3000 -timeout=20 -max_len=16384 -print_final_stats=1"

# ---- seeds: small files of every kind ----

seeds=$out/seeds
mkdir -p $seeds
bin=AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAIBAAEDAAMCAQID
gltf() # name, primitives, nodes
{
    cat >"$seeds/$1.gltf" <<END
{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[$3],"meshes":[{"primitives":[$2]}],
"buffers":[{"uri":"data:application/octet-stream;base64,$bin","byteLength":60}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}]}
END
}
gltf indexed '{"attributes":{"POSITION":0,"NORMAL":0},"indices":1}' '{"mesh":0}'
gltf strip '{"attributes":{"POSITION":0},"mode":5}' \
    '{"mesh":0,"scale":[1,2,3],"rotation":[0,0,0,1],"translation":[1,1,1]}'
gltf nested '{"attributes":{"POSITION":0},"indices":1,"mode":4}' \
    '{"children":[1]},{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}'
if have gltfpack; then
    for seed in indexed strip; do
        gltfpack -noq -i "$seeds/$seed.gltf" -o "$seeds/$seed.glb" >/dev/null 2>&1
        gltfpack -i "$seeds/$seed.gltf" -o "$seeds/$seed-quantised.glb" >/dev/null 2>&1
    done
fi

# ---- the fuzzers ----

for source in tests/fuzz/fuzz_*.c; do
    name=$(basename "$source" .c)
    case $name in
        fuzz_model) more="examples/common/model.cpp" libraries=-ltinygltf ;;
        *)          more= libraries=-lm ;;
    esac
    mkdir -p "$out/$name"
    job "$name: $seconds s" "
        clang $sanitizers -std=c99 $WARN -I. -c '$source' -o '$out/$name.o' || exit 1
        objects='$out/$name.o'
        for part in $more; do
            clang++ $sanitizers -std=c++17 -I. -c \$part -o '$out/$name-part.o' || exit 1
            objects=\"\$objects $out/$name-part.o\"
        done
        clang++ $sanitizers \$objects $libraries -lm -o '$out/$name.run' || exit 1
        # On a busy machine the seconds may go by before it has begun: a thousand inputs it is in any case.
        for limit in -max_total_time=$seconds '-runs=1000 -max_total_time=300'; do
            ASAN_OPTIONS=allocator_may_return_null=1 '$out/$name.run' \$limit $options \
                -artifact_prefix='$out/$name-' '$out/$name' '$seeds' >'$work/$name.log' 2>&1
            status=\$?
            if [ \$status != 0 ]; then grep -v '^#' '$work/$name.log' | head -n 24; exit 1; fi
            runs=\$(sed -n 's/^stat::number_of_executed_units: *//p' '$work/$name.log')
            echo \"note: \$runs inputs, no crash\"
            [ \"\$runs\" -lt 1000 ] || exit 0
        done
        exit 1"
done

cat >"$work/bad.c" <<'END'
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *copy = malloc(size + 1);
    volatile char sink = 0;
    memcpy(copy, data, size);
    if (size > 2 && data[0] == 'g') sink = copy[size + 1];
    free(copy);
    return sink & 0;
}
END
job_fails "a parser that reads one byte too far is found" "
    clang $sanitizers -std=c99 '$work/bad.c' -o '$work/bad' &&
    '$work/bad' -max_total_time=20 -artifact_prefix='$work/'" heap-buffer-overflow

jobs_end
