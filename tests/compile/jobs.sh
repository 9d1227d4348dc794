# Checks as shell commands, SSS_JOBS at a time (as many as there are processors if not set). Sourced by the scripts of
# this folder, from the top folder:
#   job "what holds" 'command'        the check passes when the command succeeds
#   job_fails "what must not" 'command' ['text']   passes when it fails; its output must contain the text
#   skip "what" "why"
#   jobs_end                          runs all, prints each with its output where it failed and its seconds where it
#                                     took ten or more, then 'N passed, N failed'
#   have TOOL                         whether it is installed;   have_32_bit: whether gcc -m32 can link
#   quick_start HEADER                prints the program of its QUICK START
# $work is an empty folder, removed at the end; $headers are the sss_*.h; WARN the flags of every compilation.

WARN="-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
headers=$(ls sss_*.h)
[ -n "$headers" ] || { echo "no sss_*.h here"; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/jobs"
job_count=0
skip_count=0

job()
{
    job_count=$((job_count + 1))
    printf '%s\n' "$1" >"$work/jobs/$job_count.label"
    printf '%s\n' "$2" >"$work/jobs/$job_count.command"
}

job_fails()
{
    job "$1" "if { $2 ; } >\"\$0.said\" 2>&1; then echo 'succeeded, but must fail'; exit 1; fi
              grep -q -e '${3:-.}' \"\$0.said\" || { cat \"\$0.said\"; echo 'failed for another reason'; exit 1; }"
}

skip()
{
    skip_count=$((skip_count + 1))
    echo "  SKIPPED  $1: $2"
}

jobs_end()
{
    export work
    seq 1 "$job_count" | xargs -P "${SSS_JOBS:-$(nproc)}" -I N sh -c \
        'start=$(date +%s)
         sh "$work/jobs/N.command" >"$work/jobs/N.out" 2>&1 </dev/null; echo $? >"$work/jobs/N.status"
         echo $(($(date +%s) - start)) >"$work/jobs/N.seconds"'
    passed=0 failed=0 n=1
    while [ $n -le $job_count ]; do
        label=$(cat "$work/jobs/$n.label")
        if [ "$(cat "$work/jobs/$n.status" 2>/dev/null)" = 0 ]; then
            passed=$((passed + 1))
            seconds=$(cat "$work/jobs/$n.seconds")
            [ "$seconds" -lt 10 ] && echo "  ok    $label" || echo "  ok    $label ($seconds s)"
            sed -n 's/^note: /        /p' "$work/jobs/$n.out"
        else
            failed=$((failed + 1))
            echo "  FAIL  $label"
            head -n 25 "$work/jobs/$n.out" | sed 's/^/        /'
        fi
        n=$((n + 1))
    done
    [ $skip_count = 0 ] || echo "$skip_count skipped"
    echo "$passed passed, $failed failed"
    [ $failed = 0 ] && [ $passed != 0 ]
}

have() { command -v "$1" >/dev/null 2>&1; }

have_32_bit() { echo 'int main(void) { return 0; }' | gcc -m32 -xc - -o "$work/probe32" 2>/dev/null; }

# The lines indented by four or more inside the comment, up to the next heading.
quick_start()
{
    awk '/^\/\/.*QUICK START/ { inside = 1; next }
         inside && (!/^\/\// || /^\/\/ ?(==|--)/ || /^\/\/ [A-Z][A-Z ]+$/) { exit }
         inside && /^\/\/     / { sub(/^\/\/     /, ""); print; next }
         inside && /^\/\/$/ { print "" }' "$1"
}

# sss_dipole.h -> dipole, DIPOLE
lower() { basename "$1" .h | sed 's/^sss_//'; }
upper() { lower "$1" | tr a-z A-Z; }
