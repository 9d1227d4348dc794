#!/bin/sh
# Every header alone and all together, in every way they may be included, in every standard, by every compiler here:
# no warning, one definition each, and the same program linked from several files. New headers are found by wildcard.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh

# ---- the ways of including ----

all_implementations= all_reversed=
for header in $headers; do
    x=$(lower "$header") X=$(upper "$header")
    {   echo "#define SSS_${X}_IMPLEMENTATION"; echo "#include \"$header\""; } >"$work/$x-implementation.c"
    {   echo "#define SSS_${X}_STATIC"; cat "$work/$x-implementation.c"; } >"$work/$x-static.c"
    {   echo "#include \"$header\""; echo "#include \"$header\""
        echo "const char *text_$x(void);"
        echo "const char *text_$x(void) { return sss_result_string(SSS_OK); }"; } >"$work/$x-declarations.c"
    # As when another file of the project has already included it, and again behind the implementation.
    {   echo "#include \"$header\""; cat "$work/$x-implementation.c"
        echo "#include \"$header\""; } >"$work/$x-repeated.c"
    {   echo "#define SSS_${X}_NO_SIMD"; cat "$work/$x-implementation.c"; } >"$work/$x-nosimd.c"
    all_implementations="$all_implementations$(cat "$work/$x-implementation.c")
"
    all_reversed="$(cat "$work/$x-implementation.c")
$all_reversed"
done
printf '%s' "$all_implementations" >"$work/all-implementation.c"
printf '%s' "$all_reversed" >"$work/all-reversed.c"

# ---- standards and compilers ----

compilers()
{
    for std in c99 c11 c17; do echo "gcc -std=$std"; echo "clang -std=$std"; done
    for std in c++11 c++14 c++17 c++20; do echo "g++ -std=$std -xc++"; echo "clang++ -std=$std -xc++"; done
}
for tool in gcc clang g++ clang++; do
    have $tool || skip "everything with $tool" "it is not installed"
done

# Objects with every header's implementation, one of each compiler: their warnings count below, and programs are linked
# from them. Some warnings need the optimiser: every header goes through it as C and as C++ (and as C with gcc wherever
# the Makefile has compiled it).
cat >"$work/objects" <<'END'
gcc -std=c99 -O0
clang -std=c99 -O2
g++ -std=c++20 -xc++ -O2
clang++ -std=c++11 -xc++ -O1
END
for header in $headers; do
    while read -r compiler; do
        ! have "${compiler%% *}" || echo "'$compiler' '$work/$(lower "$header")' '${compiler%% *}'"
    done <"$work/objects"
done >"$work/object-list"
export WARN
xargs -P "${SSS_JOBS:-$(nproc)}" -L 1 sh -c '
    $1 $WARN -I. -c "$2-implementation.c" -o "$2-$3.o" >"$2-$3.log" 2>&1' sh <"$work/object-list"

compilers >"$work/compilers"
number=0
while read -r compiler; do
    command=${compiler%% *}
    have "$command" || continue
    for unit in "$work"/*-*.c; do
        name=$(basename "$unit" .c)
        case $name in *-nosimd) grep -q "_NO_SIMD" "sss_${name%-nosimd}.h" || continue ;; esac
        # Every way of including in the oldest standard; in the newest, implementations by themselves and behind the
        # declarations; all headers in one file in between.
        case "$name $compiler" in
            all-implementation*|*std=c99|*c++11*) ;;
            *-implementation*c17|*-implementation*c++20*|*-repeated*c17|*-repeated*c++20*) ;;
            *) continue ;;
        esac
        case $name in
            all-*) object= ;;
            *-implementation) object=$(grep -x -e "$compiler -O[0-9]" "$work/objects") ;;
            *) object= ;;
        esac
        if [ -n "$object" ]; then
            built=$work/${name%-implementation}-$command
            job "$object: $name" "cat '$built.log'; [ -s '$built.o' ]"
            continue
        fi
        # Standards and ways of including are the parser's business. Code is made, which also tells what is defined and
        # not used, of private copies and without vectors, once with each compiler.
        case "$name $compiler" in
            *-static*c99|*-static*c++11*|*-nosimd*c99) level="-O0 -c" ;;
            *) level=-fsyntax-only ;;
        esac
        number=$((number + 1))
        job "$compiler $level: $name" "$compiler $level $WARN -I. '$unit' -o '$work/$number.o'"
    done
done <"$work/compilers"

# What users set by hand: instruction sets at compile time, size, no assertions.
for header in $headers; do
    x=$(lower "$header")
    for compiler in "gcc -O3 -march=x86-64-v4" "gcc -Os -DNDEBUG"; do
        have "${compiler%% *}" || continue
        number=$((number + 1))
        job "$compiler: $x-implementation" "
            $compiler -std=c99 $WARN -I. -c '$work/$x-implementation.c' -o '$work/$number.o'"
    done
done

# ---- linking: every public function, declared in one file and defined in another, with libc and libm alone ----

for header in $headers; do
    x=$(lower "$header")
    functions=$(nm -g --defined-only "$work/$x-gcc.o" | awk '$2 == "T" { print $3 }')
    {   echo "#include \"$header\""
        echo "#include <stdio.h>"
        echo "typedef void (*function)(void);"
        echo "int main(void)"
        echo "{"
        echo "    static const function functions[] = {"
        for function in $functions; do echo "        (function)$function,"; done
        echo "    };"
        echo "    size_t missing = 0, count = sizeof functions / sizeof *functions;"
        echo "    for (size_t i = 0; i < count; ++i) missing += functions[i] == NULL;"
        printf '%s\n' '    printf("note: %u public functions\n", (unsigned)count);'
        echo "    return missing != 0;"
        echo "}"; } >"$work/$x.main"
    # extern "C": defined by one language, used from the other.
    for pair in gcc:gcc gcc:g++ g++:gcc clang:clang++ clang++:clang; do
        one=${pair%:*} two=${pair#*:}
        have "$one" && have "$two" || continue
        out=$work/$x-$one-$two
        job "$header: implementation by $one, users by $two, linked with -lm alone" "
            case $two in *++) b='-xc++ -std=c++11' ;; *) b='-xc -std=c99' ;; esac
            $two \$b -O0 -I. -c '$work/$x.main' -o '$out.2.o' &&
            $two \$b -O0 -I. -c '$work/$x-declarations.c' -o '$out.3.o' &&
            $two '$work/$x-$one.o' '$out.2.o' '$out.3.o' -lm -o '$out' && '$out'"
    done
    gcc -std=c99 -I. -c -xc "$work/$x.main" -o "$work/$x-main.o"
    job "$header: two files with private copies (STATIC) beside the public one" "
        gcc -std=c99 -I. -c '$work/$x-static.c' -o '$work/$x-s1.o' && cp '$work/$x-s1.o' '$work/$x-s2.o' &&
        gcc '$work/$x-s1.o' '$work/$x-s2.o' '$work/$x-main.o' '$work/$x-gcc.o' -lm -o '$work/$x-copies' &&
        [ -z \"\$(nm -g --defined-only '$work/$x-s1.o')\" ] && '$work/$x-copies'"
    job_fails "$header: two public copies clash, as they should" "
        cp '$work/$x-gcc.o' '$work/$x-p2.o' &&
        gcc '$work/$x-gcc.o' '$work/$x-p2.o' '$work/$x-main.o' -lm -o '$work/$x-clash'" 'multiple definition'
done

# Every header's code in a file of its own, all in one program: no name is defined twice.
objects=
for header in $headers; do objects="$objects '$work/$(lower "$header")-gcc.o'"; done
job "all headers, each with a file of its own, in one program" "
    gcc '$work/dipole-main.o' $objects -lm -o '$work/together' && '$work/together'"

# ---- the common block ----

block() { sed -n '/^\/\/ ---- BEGIN sss common block/,/^\/\/ ---- END sss common block/p' "$1"; }
block sss_dipole.h >"$work/block"
for header in $headers; do
    block "$header" >"$work/block-$(lower "$header")"
    job "$header: its common block is that of sss_dipole.h, byte for byte" "
        [ \$(wc -l <'$work/block') -gt 20 ] && cmp '$work/block' '$work/block-$(lower "$header")'"
    job_fails "$header: refuses the common block of another release" "
        printf '#define SSS_COMMON_VERSION 999999\n#include \"$header\"\n' | gcc -fsyntax-only -I. -xc -" \
        'different releases'
done
sed 's/SSS_ERROR_EMPTY,/SSS_ERROR_VOID, /' "$work/block" >"$work/block-mutated"
job_fails "a changed common block is noticed" "cmp '$work/block' '$work/block-mutated'" differ

# ---- other machines: test_readme.sh has 32 bit and ARM optimise the same code ----

for header in $headers; do
    x=$(lower "$header")
    if have_32_bit; then
        job "$header: 32 bit, compiled, linked, run" "
            gcc -m32 -std=c99 -O0 $WARN -I. -c '$work/$x-implementation.c' -o '$work/$x-32.o' &&
            gcc -m32 -std=c99 -I. -xc '$work/$x.main' -xnone '$work/$x-32.o' -lm -o '$work/$x-32' && '$work/$x-32'"
    else
        skip "$header: 32 bit" "gcc -m32 finds no libraries (libc6-dev-i386, lib32gcc-12-dev)"
    fi
    if have x86_64-w64-mingw32-gcc; then
        job "$header: Windows, compiled and linked" "
            x86_64-w64-mingw32-gcc -std=c99 -O1 $WARN -I. -c '$work/$x-implementation.c' -o '$work/$x-w.o' &&
            x86_64-w64-mingw32-gcc -std=c99 -I. -xc '$work/$x.main' -xnone '$work/$x-w.o' -o '$work/$x-w.exe'"
    else
        skip "$header: Windows" "x86_64-w64-mingw32-gcc is not installed"
    fi
    if have aarch64-linux-gnu-gcc && have qemu-aarch64; then
        job "$header: 64-bit ARM, compiled, linked, run under qemu" "
            aarch64-linux-gnu-gcc -std=c99 -O0 $WARN -I. -c '$work/$x-implementation.c' -o '$work/$x-a.o' &&
            aarch64-linux-gnu-gcc -std=c99 -I. -xc '$work/$x.main' -xnone '$work/$x-a.o' -lm -o '$work/$x-a' &&
            qemu-aarch64 -L /usr/aarch64-linux-gnu '$work/$x-a'"
    else
        skip "$header: 64-bit ARM" "aarch64-linux-gnu-gcc or qemu-aarch64 is not installed"
    fi
done

# ---- the gate itself: it must notice what it is there for ----

printf 'float f(double d);\nfloat f(double d) { return d; }\n' >"$work/bad.c"
for compiler in "gcc -c" "gcc -fsyntax-only" "clang -fsyntax-only" "g++ -xc++ -fsyntax-only" \
        "clang++ -xc++ -fsyntax-only"; do
    ! have "${compiler%% *}" ||
        job_fails "$compiler: a conversion that loses bits is noticed" "
            $compiler $WARN '$work/bad.c' -o '$work/bad.o'" 'float-conversion\|shorten\|implicit-float'
done
printf 'static void f(void) {}\n' >"$work/unused.c"
for compiler in "gcc -c" "clang -fsyntax-only" "g++ -xc++ -c" "clang++ -xc++ -fsyntax-only"; do
    ! have "${compiler%% *}" ||
        job_fails "$compiler: a function that nothing uses is noticed" "
            $compiler $WARN '$work/unused.c' -o '$work/unused.o'" unused-function
done

jobs_end
