#!/bin/sh
# The GLFW path under a virtual display: every example that opens a window shows the bunny in it, turns it when the
# pointer drags, and leaves with status 0 when Escape is pressed; without a display it says so and fails.
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
. tests/common/window.sh
need Xvfb xdotool gltfpack

# A thin bunny: the picture does not depend on it, but the time does.
mesh=$work/small.glb
gltfpack -noq -si 0.03 -i build/models/bunny.glb -o "$mesh" >/dev/null 2>&1

in_a_window() # label, command...
{
    label=$1 folder=$work/screen-$1
    shift
    mkdir "$folder"
    start_server "$folder"
    start_program "$folder/said" "$@"

    wait_for 60 many_colours "$folder"; shown=$?
    seen=$(colours "$folder")
    before=$(picture "$folder")
    # A drag to the right over the middle of the window.
    on_screen mousemove 400 400 mousedown 1 mousemove 460 410 mousemove 560 430 sleep 0.5 mouseup 1
    wait_for 20 changed "$folder" "$before"; turned=$?
    focus
    stop_program 1

    job "$label: shows a picture" "echo 'note: $seen colours on the screen'; [ $shown = 0 ]"
    job "$label: turns when the pointer drags" "[ $turned = 0 ]"
    job "$label: Escape ends it with status 0" "cat '$folder/said'; [ '$left $status' = '0 0' ]"
}

for source in examples/*.c; do
    name=$(basename "$source" .c)
    grep -q gl_context_create_window "$source" || continue
    in_a_window "$name" "build/$name" "$mesh"
    job_fails "$name: without a display it fails and says why" \
        "env -u DISPLAY -u WAYLAND_DISPLAY 'build/$name' '$mesh'" 'display'
    job "$name --headless: needs no display, writes a picture" "
        env -u DISPLAY -u WAYLAND_DISPLAY 'build/$name' '$mesh' --headless '$work/$name.png' ||
            env -u DISPLAY -u WAYLAND_DISPLAY 'build/$name' '$mesh' marble 40 --headless '$work/$name.png'
        [ \$(wc -c <'$work/$name.png') -gt 20000 ]"
done
job "some example opens a window" "[ $job_count -gt 0 ]"

jobs_end
