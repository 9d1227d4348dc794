#!/bin/sh
# The GLSL pieces of every header: no #version line, under 4,095 characters, only names beginning with sss_, and each
# compiles, alone behind what it builds on, in both stages, given once or twice, as 330 core, 450 core and 300 es.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh

have glslangValidator || { echo "glslangValidator is not installed"; echo "0 passed, 1 failed"; exit 1; }

# Writes the pieces of a header to $work/X-0.glsl, ... ; the pieces are an enumeration from 0 up, NULL behind the last.
pieces()
{
    cat >"$work/$1.c" <<END
#define SSS_$2_IMPLEMENTATION
#include "sss_$1.h"
#include <stdio.h>
int main(void)
{
    for (int i = 0; sss_$1_glsl((sss_$1_glsl_piece)i) != NULL; ++i)
    {
        char name[32];
        snprintf(name, sizeof name, "$1-%d.glsl", i);
        FILE *file = fopen(name, "wb");
        if (!file || fputs(sss_$1_glsl((sss_$1_glsl_piece)i), file) < 0 || fclose(file) != 0) return 1;
    }
    return 0;
}
END
    gcc -std=c99 -O0 -I. "$work/$1.c" -o "$work/$1" -lm && (cd "$work" && "./$1")
}

shader() # version, stage, files...
{
    version=$1 stage=$2; shift 2
    echo "#version $version"
    cat "$@"
    if [ $stage = frag ]; then echo "out vec4 result; void main() { result = vec4(0.0); }"
    else echo "void main() { gl_Position = vec4(0.0); }"
    fi
}

compile() # label, name, files...
{
    label=$1 name=$2; shift 2
    for version in "330 core" "450 core" "300 es"; do
        for stage in vert frag; do
            source=$work/$name-$(echo "$version" | tr -d ' ').$stage
            shader "$version" $stage "$@" >"$source"
            job "$label: $version, $stage" "glslangValidator '$source'"
        done
    done
}

base= # the shared snippets, which every other header's build on
for x in dipole $(for h in $headers; do lower "$h"; done | grep -v '^dipole$'); do
    [ -e "sss_$x.h" ] || continue
    grep -q "sss_${x}_glsl(" "sss_$x.h" || { skip "sss_$x.h" "it has no GLSL"; continue; }
    pieces "$x" "$(upper "sss_$x.h")" || { job "sss_$x.h: its pieces can be written out" false; continue; }
    all=$base
    index=0
    while [ -e "$work/$x-$index.glsl" ]; do
        piece=$work/$x-$index.glsl
        job "$x piece $index: no #version, at most 4094 characters, has a guard of its own" "
            echo \"note: \$(wc -c <'$piece') characters, \$(wc -l <'$piece') lines\"
            ! grep -q '#version' '$piece' && [ \$(wc -c <'$piece') -le 4094 ] && [ \$(wc -c <'$piece') -gt 40 ] &&
            grep -q '^#ifndef' '$piece'"
        job "$x piece $index: lines of at most 120 characters, ASCII" \
            "! grep -n -E '.{121,}' '$piece' && ! LC_ALL=C grep -n '[^ -~]' '$piece'"
        all="$all $piece"
        compile "$x pieces 0..$index" "$x-$index" $all
        index=$((index + 1))
    done
    compile "$x pieces, all given twice" "$x-twice" $all $all
    if [ $x = dipole ]; then
        base=$all
        compile "dipole piece 0 alone" dipole-fresnel "$work/dipole-0.glsl"
        compile "dipole piece 2 alone" dipole-tone "$work/dipole-2.glsl"
        job "dipole has three pieces" "[ $index = 3 ]"
    fi
done

printf 'void f() { int i = 1.5; }\n' >"$work/bad.glsl"
shader "330 core" frag "$work/bad.glsl" >"$work/bad.frag"
job_fails "a wrong shader is noticed" "glslangValidator '$work/bad.frag'" ERROR

jobs_end
