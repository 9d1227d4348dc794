#!/bin/sh
# examples/bem in a window, under a virtual display: it moves by itself, every key does what the first lines of bem.c
# say, and what it prints of its times follows.     BEM: the program, build/bem if not given
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
. tests/common/window.sh
need Xvfb xdotool
bem=${BEM:-build/bem}

said() { tail -n 1 "$work/said" | grep -q -e "$1"; }
press() { DISPLAY=$display xdotool key --delay 80 "$1" >>"$work/log" 2>&1; }

# A key, and what the next line of times must then say.
after() # key, text
{
    [ $moving = 0 ] && press "$1" && wait_for 20 said "$2"
    echo $? >"$work/after-$1"
    cp "$work/said" "$work/after-$1.said"
}

start_server "$work"
DISPLAY=$display LIBGL_ALWAYS_SOFTWARE=1 "$bem" >"$work/said" 2>&1 &
program=$!

wait_for 60 said 'candle, .* on the fly: .*scatter'; started=$?
window=$(DISPLAY=$display xdotool search --onlyvisible --name . 2>>"$work/log" | head -n 1)
DISPLAY=$display xdotool windowfocus "${window:-0}" sleep 0.3 >>"$work/log" 2>&1
before=$(picture "$work")
wait_for 20 changed "$work" "$before"; moving=$?
after i 'candle, .* wax, incremental:'
after h 'candle, .* render: move 0.0,'
after m 'candle, .* 100 mm, .* skimmilk,'
after minus 'candle, .* 80 mm, .* skimmilk, render:'
after space 'cube, .* 40 mm, both lamps, skimmilk, incremental:'
after l 'cube, .* first lamp, '
press Escape
wait_for 20 gone $program; left=$?
[ $left = 0 ] || kill $program 2>/dev/null
wait $program; status=$?
kill $server 2>/dev/null
wait $server 2>/dev/null

job "prints what every stage of a frame takes" "sed 's/^/note: /' '$work/said' | head -n 1; [ $started = 0 ]"
job "the candle moves by itself" "[ $moving = 0 ]"
for key in i h m minus space l; do
    job "key $key" "tail -n 1 '$work/after-$key.said' | sed 's/^/note: /'; [ \$(cat '$work/after-$key') = 0 ]"
done
job "Escape ends it with status 0" "cat '$work/said'; [ '$left $status' = '0 0' ]"
job_fails "without a display it fails and says why" "env -u DISPLAY -u WAYLAND_DISPLAY '$bem'" display
job "--headless: needs no display, writes a picture, prints four modes of two scenes" "
    env -u DISPLAY -u WAYLAND_DISPLAY '$bem' --headless '$work/strip.png' >'$work/strip.said' &&
    [ \$(wc -c <'$work/strip.png') -gt 20000 ] && [ \$(grep -c 'scatter' '$work/strip.said') = 8 ]"
job_fails "a mesh that is not there" "'$bem' '$work/absent.glb' --headless '$work/no.png'" 'cannot open'
job_fails "wrong arguments" "'$bem' one two" usage

jobs_end
