#!/bin/sh
# The layout that the family keeps to: what lies at the top, how long lines are, how long a header's example is, and the
# anatomy of every header.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh

job "nothing lies at the top that does not belong there" "
    for entry in * .[!.]*; do
        case \$entry in
            sss_dipole.h|sss_atlas.h|sss_lensch.h|sss_hao.h|sss_bem.h|sss_tsis.h|sss_biscale.h) ;;
            examples|tests|README.md|LICENSE|CHANGELOG.md|Makefile|.ci|.git|.gitignore|build) ;;
            *) echo \"\$entry\"; bad=1 ;;
        esac
    done
    [ -z \"\${bad:-}\" ]"
job "no header of the library lies elsewhere" "[ -z \"\$(find examples tests -name 'sss_*.h')\" ]"

find $headers Makefile .ci examples tests -type f \( -name '*.[ch]' -o -name '*.cpp' -o -name '*.sh' -o -name '*.gp' \
    -o -name Makefile -o -name run \) | sort >"$work/sources"
job "at least twenty sources are looked at" "[ \$(wc -l <'$work/sources') -ge 20 ]"
job "no line is longer than 120 columns" "! xargs grep -n -E '^.{121,}' <'$work/sources'"
job "no tab outside a Makefile, no space at the end of a line, only ASCII" "
    grep -v Makefile '$work/sources' | xargs grep -n \"\$(printf '\t')\"; tabs=\$?
    xargs grep -n ' \$' <'$work/sources'; ends=\$?
    LC_ALL=C xargs grep -n '[^ -~]' <'$work/sources' | grep -v Makefile; other=\$?
    [ \$tabs\$ends\$other != 000 ] && [ \$tabs != 0 ] && [ \$ends != 0 ] && [ \$other != 0 ]"
job "every file ends with a line break" "
    while read -r file; do [ -z \"\$(tail -c 1 \"\$file\")\" ] || { echo \"\$file\"; exit 1; }; done <'$work/sources'"

for header in $headers; do
    x=$(lower "$header")
    job "$header: its parts stand in the family's order" "
        awk '/QUICK START/ && !a { a = NR } /THEORY/ && a && !b { b = NR } /LIMITS/ && b && !c { c = NR }
             /=+ CONFIGURATION/ && c && !d { d = NR } /=+ API/ && d && !e { e = NR } /=+ GLSL/ && e && !f { f = NR }
             /=+ IMPLEMENTATION/ && f && !g { g = NR } END { exit !g }' $header"
    job "$header: says its licence and what changed" "grep -q 'MIT-0' $header && grep -q -i 'change log' $header"
    job "$header: no pragma silences a warning" "! grep -n -E '#pragma .*(diagnostic|warning)|_Pragma' $header"
    job "examples/$x.c: is there, at most 120 lines" \
        "lines=\$(wc -l <examples/$x.c); echo \"note: \$lines lines\"; [ \$lines -le 120 ]"
    job "tests/test_$x.c: is there" "[ -s tests/test_$x.c ]"
done

printf 'int a; %0121d\n' 0 >"$work/long.c"
job_fails "a line that is too long is noticed" "! grep -n -E '^.{121,}' '$work/long.c'" 'int a'
jobs_end
