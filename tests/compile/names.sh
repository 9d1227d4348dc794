#!/bin/sh
# Lists what a header puts outside its own names, one a line; succeeds when there is nothing.
#   tests/compile/names.sh HEADER [FOLDER-OF-HEADER]
# Own names: sss_X_* and SSS_X_*, and those of the common block. Looked at: macros, types, enumerators, variables,
# functions (public, and private ones that the optimiser would drop), writable data, and calls that a library has no
# business making (printing, exiting, threads, files, clocks).
set -eu
header=$1
folder=${2:-.}
x=$(basename "$header" .h | sed 's/^sss_//')
X=$(echo "$x" | tr a-z A-Z)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

printf '#define SSS_%s_IMPLEMENTATION\n#include "%s"\n' "$X" "$header" >"$work/with.c"
# The system headers that it includes, alone: what they define is not the header's. Includes inside #if are wanted too,
# as far as this compiler takes them.
grep -h '^ *# *include *<' "$folder/$header" | sort -u | while read -r line; do
    echo "$line" >"$work/probe.c"
    if gcc -std=c99 -fsyntax-only "$work/probe.c" 2>/dev/null; then echo "$line"; fi
done >"$work/system.c"

common_types="sss_result sss_hooks sss_mesh sss_profile"
common_values="SSS_OK SSS_ERROR_INVALID_ARGUMENT SSS_ERROR_EMPTY SSS_ERROR_INDEX SSS_ERROR_OVERFLOW
    SSS_ERROR_OUT_OF_MEMORY SSS_ERROR_CANCELLED SSS_ERROR_NOT_FOUND SSS_ERROR_BAD_DATA SSS_ERROR_BAD_VERSION
    SSS_ERROR_MISMATCH"
common="$common_types $common_values sss_result_string SSS_COMMON_VERSION"

# Keeps the lines "kind name" whose name is not the header's own.
foreign()
{
    awk -v x="^(sss_${x}_|SSS_${X}_|sss_${x}\$)" -v common="$common" '
        BEGIN { n = split(common, list); for (i = 1; i <= n; ++i) own[list[i]] = 1 }
        !($2 in own) && $2 !~ x'
}

# ---- macros ----
for unit in with system; do
    gcc -std=c99 -I"$folder" -dM -E "$work/$unit.c" | sed 's/^#define \([A-Za-z_0-9]*\).*/macro \1/' | sort -u \
        >"$work/$unit.macros"
done
comm -23 "$work/with.macros" "$work/system.macros" | foreign >"$work/leaks"

# ---- declarations: types, enumerators, variables, functions, from the compiler's own tree ----
declarations()
{
    clang -std=c99 -I"$folder" -w -fsyntax-only -Xclang -ast-dump -fno-color-diagnostics "$1" | sed -n \
        -e 's/^[|`]-\(FunctionDecl\|TypedefDecl\|VarDecl\) .* \([A-Za-z_][A-Za-z_0-9]*\) '"'"'.*/\1 \2/p' \
        -e 's/^[|`]-RecordDecl .* \(struct\|union\) \([A-Za-z_][A-Za-z_0-9]*\)\( definition\)*$/tag \2/p' \
        -e 's/^[|`]-EnumDecl .* \([A-Za-z_][A-Za-z_0-9]*\)$/tag \1/p' \
        -e 's/^[|` ] [|`]-EnumConstantDecl .* \([A-Za-z_][A-Za-z_0-9]*\) '"'"'.*/EnumConstantDecl \1/p' |
        grep -v -E ' (col|line|__builtin_.*)$' | sort -u
}
declarations "$work/with.c" >"$work/with.names"
declarations "$work/system.c" >"$work/system.names"
comm -23 "$work/with.names" "$work/system.names" | foreign >>"$work/leaks"

# ---- symbols of the object file ----
gcc -std=c99 -O0 -fno-pic -fno-pie -fkeep-static-functions -I"$folder" -c "$work/with.c" -o "$work/with.o"
nm --defined-only "$work/with.o" | awk '$2 ~ /^[A-Z]$/ { print "public " $3 }' | foreign >>"$work/leaks"
nm --defined-only "$work/with.o" | awk '$2 ~ /^[A-Z]$/ && $3 ~ /^sss_[a-z]*__/ { print "private-but-public " $3 }' \
    >>"$work/leaks"
nm --defined-only "$work/with.o" | awk '$2 ~ /^[a-z]$/ && $3 !~ /\./ { print "private " $3 }' | foreign >>"$work/leaks"
# No state: nothing writable, be it static inside a function.
nm --defined-only "$work/with.o" | awk '$2 ~ /^[dDbBcCsSgG]$/ { print "writable " $3 }' >>"$work/leaks"
forbidden='.*printf|puts|putchar|fputs|fwrite|fopen|exit|_exit|quick_exit|abort|__assert_fail|raise|signal|pthread_.*'
forbidden="$forbidden|thrd_.*|getenv|setlocale|rand|srand|time|clock|clock_gettime|stdout|stderr|stdin"
nm --undefined-only "$work/with.o" | awk '{ print "calls " $2 }' | grep -E " ($forbidden)\$" |
    grep -v -E ' v?snprintf$' >>"$work/leaks" || true

if [ "${NAMES_VERBOSE:-0}" = 1 ]; then cat "$work/with.names" >&2; fi
count=$(comm -23 "$work/with.names" "$work/system.names" | wc -l)
macros=$(comm -23 "$work/with.macros" "$work/system.macros" | wc -l)
echo "note: $count declarations, $macros macros, $(nm --defined-only "$work/with.o" | wc -l) symbols"
sed 's/^/leak: /' "$work/leaks"
[ "$count" -gt 10 ] && [ ! -s "$work/leaks" ]
