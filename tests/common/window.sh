# A program on a virtual display whose picture can be looked at. Sourced, from the top folder, behind
# tests/compile/jobs.sh.
#   start_server FOLDER; start_program WORDS COMMAND...; focus; press KEY; ...; stop_program

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

# Starts a display whose screen is kept in a folder; sets $screen, the folder, $server, its process, and $display.
start_server() # folder
{
    screen=$1
    Xvfb -displayfd 3 -screen 0 1024x1000x24 -fbdir "$1" 3>"$1/number" >"$1/log" 2>&1 &
    server=$!
    wait_for 20 test -s "$1/number"
    display=:$(cat "$1/number")
}

# Starts a program there; sets $program, its process.
start_program() # file for what it says, command...
{
    words=$1
    shift
    DISPLAY=$display LIBGL_ALWAYS_SOFTWARE=1 "$@" >"$words" 2>&1 &
    program=$!
}

on_screen() { DISPLAY=$display xdotool "$@" >>"$screen/log" 2>&1; }

# Gives the window the keyboard: there is no window manager that would.
focus()
{
    window=$(DISPLAY=$display xdotool search --onlyvisible --name . 2>>"$screen/log" | head -n 1)
    on_screen windowfocus "${window:-0}" sleep 0.3
}

press() { on_screen keydown "$1" sleep "${2:-0.08}" keyup "$1"; } # key, seconds

# Presses Escape, which must end the program; kills what is left; sets $left, 0 where it ended, and $status, its own.
stop_program()
{
    press Escape "${1:-0.08}"
    wait_for 20 gone $program; left=$?
    [ $left = 0 ] || kill $program 2>/dev/null
    wait $program; status=$?
    kill $server 2>/dev/null
    wait $server 2>/dev/null
}

# The last line of a program's words.
says() { tail -n 1 "$words" | grep -q -e "$1"; } # pattern

# Colours in the last picture of the screen, and its checksum. Xvfb keeps the screen in a file: a header, then 32 bits
# a pixel.
pixels() { tail -c $((1024 * 1000 * 4)) "$1/Xvfb_screen0"; }
colours() { pixels "$1" | od -An -v -tx4 -w4 | sort -u | wc -l; }
picture() { pixels "$1" | cksum; }
many_colours() { [ "$(colours "$1")" -gt 300 ]; } # folder
changed() { [ "$(picture "$1")" != "$2" ]; } # folder, checksum before
gone() { ! kill -0 "$1" 2>/dev/null; }
