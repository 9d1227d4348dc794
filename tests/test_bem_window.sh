#!/bin/sh
# examples/bem in a window, under a virtual display: it moves by itself, every key does what the first lines of bem.c
# say, and what it prints of its times follows.     BEM: the program, build/bem if not given
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
. tests/common/window.sh
need Xvfb xdotool
bem=${BEM:-build/bem}

# A key, and what the next line of times must then say.
after() # key, text
{
    [ $moving = 0 ] && press "$1" && wait_for 20 says "$2"
    echo $? >"$work/after-$1"
    cp "$work/said" "$work/after-$1.said"
}

start_server "$work"
start_program "$work/said" "$bem"

wait_for 60 says 'candle, .* on the fly: .*scatter'; started=$?
focus
before=$(picture "$work")
wait_for 20 changed "$work" "$before"; moving=$?
after i 'candle, .* wax, incremental:'
after h 'candle, .* render: move 0.0,'
after m 'candle, .* 100 mm, .* skimmilk,'
after minus 'candle, .* 80 mm, .* skimmilk, render:'
after space 'cube, .* 40 mm, both lamps, skimmilk, incremental:'
after l 'cube, .* first lamp, '
stop_program

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
