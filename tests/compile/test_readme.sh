#!/bin/sh
# The code that people copy: every C block of README.md and every header's QUICK START compiles without a warning as C
# and as C++ and runs; every command of README.md exists and works; what README.md says about the headers is so.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
top=$PWD

# ---- extraction ----

# ```c blocks of a Markdown file into $work/NAME-1.c, ... ; ```sh blocks into $work/NAME-1.sh, ...
blocks()
{
    awk -v out="$work/$2" '
        /^```(c|sh)$/ { kind = substr($0, 4); file = out "-" ++n[kind] "." kind; inside = 1; next }
        /^```/ { inside = 0; next }
        inside { print > file }' "$1"
}

blocks README.md readme
for header in $headers; do quick_start "$header" >"$work/$(lower "$header")-quick.c"; done

# ---- C ----

# README.md's programs run here, built by every compiler; QUICK STARTs, with the same implementations and less to do,
# also on other machines, optimised once with each machine's gcc: test_compile.sh has it find warnings.
others() # name, source
{
    job "$1: is there, a whole program of at most 40 lines" \
        "lines=\$(sed -e :a -e '/^\n*\$/{\$d;N;ba' -e '}' '$2' | wc -l); echo \"note: \$lines lines\"
         grep -q 'int main' '$2' && [ \$lines -le 40 ]"
    if have_32_bit; then
        job "$1: in 32 bit" "gcc -m32 -std=c99 -O1 $WARN -I. '$2' -o '$work/$1-32' -lm &&
            cd '$work' && timeout 120 '$work/$1-32' >/dev/null"
    else skip "$1: in 32 bit" "gcc -m32 finds no libraries"
    fi
    if have aarch64-linux-gnu-gcc && have qemu-aarch64; then
        job "$1: on 64-bit ARM under qemu" "
            aarch64-linux-gnu-gcc -std=c99 -O1 $WARN -I. '$2' -o '$work/$1-arm' -lm &&
            cd '$work' && timeout 300 qemu-aarch64 -L /usr/aarch64-linux-gnu '$work/$1-arm' >/dev/null"
    else skip "$1: on 64-bit ARM" "no cross compiler or qemu"
    fi
}
programs=0
for source in "$work"/readme-*.c "$work"/*-quick.c; do
    [ -e "$source" ] || continue
    name=$(basename "$source" .c)
    case $name in
        *-quick) others "$name" "$source" ;;
        *) job "$name: is a whole program" "grep -q 'int main' '$source'" ;;
    esac
    programs=$((programs + 1))
    for compiler in "gcc -std=c99 -O1" "clang -std=c99 -O0" "g++ -std=c++11 -O0 -xc++" \
            "clang++ -std=c++11 -O0 -xc++"; do
        have "${compiler%% *}" || { skip "$name: $compiler" "not installed"; continue; }
        program=$work/$name-$(echo "$compiler" | tr -cd a-z0-9)
        job "$name: $compiler, and runs" "
            $compiler $WARN -I. '$source' -o '$program' -lm &&
            cd '$work' && timeout 120 '$program' >'$program.said' && [ -s '$program.said' ]"
    done
done
job "README.md has C code, and every header a QUICK START" \
    "[ $programs -gt $(echo "$headers" | wc -l) ]"

# ---- commands: make targets must exist; everything else is run, in a folder that sees this one ----

mkdir "$work/run"
for entry in * ; do ln -s "$top/$entry" "$work/run/$entry"; done
[ ! -e "$work/readme-1.c" ] || cp "$work/readme-1.c" "$work/run/quick.c"
commands=0
for script in "$work"/readme-*.sh; do
    [ -e "$script" ] || continue
    sed -e :a -e '/\\$/{N;s/\\\n *//;ba' -e '}' "$script" | grep -v -e '^ *#' -e '^ *$' >"$script.lines"
    while IFS= read -r line; do
        commands=$((commands + 1))
        case $line in
            make*) target=$(echo "${line%%#*}" | sed 's/^make *//')
                   job "README.md: $line" "make -n $target >/dev/null" ;;
            git*|cd*) ;;
            *)     job "README.md: $line" "cd '$work/run' && $line" ;;
        esac
    done <"$script.lines"
done
job "README.md has the two commands" \
    "[ $commands -ge 2 ] && grep -q '^make demo' '$work'/readme-*.sh && grep -q '^make test' '$work'/readme-*.sh"

# ---- what it says ----

for x in dipole atlas lensch hao bem tsis biscale; do
    if [ -e sss_$x.h ]; then
        job "README.md: sss_$x.h is listed as there" "grep '^|.*sss_$x\.h' README.md | grep -v -q 'not yet'"
    else
        job "README.md: sss_$x.h is listed as not yet there" "grep '^|.*sss_$x\.h' README.md | grep -q 'not yet'"
    fi
done
job "README.md: its table is that of chart.csv" "sh tests/chart/table.sh --check"
job "README.md: its table of atlases is that of atlas.csv" "sh tests/chart/atlas.sh --check"
job "README.md: its tables of what examples take are those of examples.csv" "sh tests/chart/examples.sh --check"
for link in $(grep -o ']([^)#:]*)' README.md | tr -d ']()'); do
    job "README.md: $link exists" "[ -e '$link' ]"
done

jobs_end
