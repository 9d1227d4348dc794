# A virtual display whose picture can be looked at. Sourced, from the top folder, behind tests/compile/jobs.sh.

need() # tool...: ends the test where one is not installed
{
    for tool in "$@"; do
        have "$tool" || { echo "$tool is not installed"; echo "0 passed, 1 failed"; exit 1; }
    done
}

wait_for() # seconds, command...: until it succeeds
{
    tries=$(($1 * 10)); shift
    while ! "$@"; do
        tries=$((tries - 1))
        [ $tries -gt 0 ] || return 1
        sleep 0.1
    done
}

# Starts a display whose screen is kept in a folder; sets $server, its process, and $display.
start_server() # folder
{
    Xvfb -displayfd 3 -screen 0 1024x1000x24 -fbdir "$1" 3>"$1/number" >"$1/log" 2>&1 &
    server=$!
    wait_for 20 test -s "$1/number"
    display=:$(cat "$1/number")
}

# Colours in the last picture of the screen, and its checksum. Xvfb keeps the screen in a file: a header, then 32 bits
# a pixel.
pixels() { tail -c $((1024 * 1000 * 4)) "$1/Xvfb_screen0"; }
colours() { pixels "$1" | od -An -v -tx4 -w4 | sort -u | wc -l; }
picture() { pixels "$1" | cksum; }
changed() { [ "$(picture "$1")" != "$2" ]; } # folder, checksum before
gone() { ! kill -0 "$1" 2>/dev/null; }
