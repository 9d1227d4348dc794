#!/bin/sh
# examples/atlas: in a window, under a virtual display, M goes from method to method; headless it draws each method and
# says what it made; wrong arguments are refused.     ATLAS: the program, build/atlas if not given
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
. tests/common/window.sh
need Xvfb xdotool gltfpack
atlas=${ATLAS:-build/atlas}
mesh=$work/small.glb
gltfpack -noq -si 0.1 -i build/models/bunny.glb -o "$mesh" >/dev/null 2>&1

last_method() { [ "$(sed -n 's/^atlas_method=//p' "$work/said" | tail -n 1)" = "$1" ]; }

start_server "$work"
start_program "$work/said" "$atlas" "$mesh" --size 512
wait_for 60 many_colours "$work"; shown=$?
focus
for method in area convex orthographic; do
    before=$(picture "$work")
    press m
    wait_for 30 last_method $method && wait_for 20 changed "$work" "$before"
    echo $? >"$work/went-$method"
done
stop_program

job "shows a picture" "[ $shown = 0 ]"
for method in area convex orthographic; do
    job "key M: $method" "[ \$(cat '$work/went-$method') = 0 ]"
done
job "Escape ends it with status 0" "[ '$left $status' = '0 0' ]"

for method in orthographic area convex; do
    job "--headless, $method: a picture, what was made, nothing overlaps, all of the surface has texels" "
        env -u DISPLAY -u WAYLAND_DISPLAY '$atlas' '$mesh' --method $method --size 512 --headless '$work/$method.png' \
            >'$work/$method.said' &&
        [ \$(wc -c <'$work/$method.png') -gt 50000 ] && grep -q '^atlas_method=$method\$' '$work/$method.said' &&
        grep -q '^atlas_overlaps=0\$' '$work/$method.said' && grep -q '^atlas_size=512\$' '$work/$method.said' &&
        awk -F= '/^atlas_(charts|utilisation|texel_area_error)=/ { print \"note: \" \$0 }
            /^atlas_texel_area_error=/ { ok = \$2 < 1e-6 } END { exit !ok }' '$work/$method.said'"
done
job_fails "a mesh that is not there" "'$atlas' '$work/absent.glb' --headless '$work/no.png'" 'cannot open'
job_fails "an unknown method" "'$atlas' --method magic --headless '$work/no.png'" usage
job_fails "a size out of range" "'$atlas' --size 63 --headless '$work/no.png'" usage
job_fails "an option without its value" "'$atlas' --headless" usage
job_fails "a picture that cannot be written" "'$atlas' '$mesh' --headless '$work/absent/no.png'" 'cannot write'

jobs_end
