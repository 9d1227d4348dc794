#!/bin/sh
# examples/hao: in a window, under a virtual display, the light circles, H holds it, G lets the vertex shader shade;
# headless it draws five panels for each of three places of the light; wrong arguments are refused.
# HAO: the program, build/hao if not given
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
. tests/common/window.sh
need Xvfb xdotool gltfpack
hao=${HAO:-build/hao}
mesh=$work/small.glb
gltfpack -noq -si 0.06 -i build/models/bunny.glb -o "$mesh" >/dev/null 2>&1

start_server "$work"
start_program "$work/said" "$hao" "$mesh"
wait_for 60 many_colours "$work"; shown=$?
focus
wait_for 20 says 'uncompressed .* harmonics .* reference points .* off)'; told=$?
before=$(picture "$work")
wait_for 20 changed "$work" "$before"; moving=$?
press g
wait_for 20 says 'vertex shader'; shader=$?
press h
sleep 1.5 # frames that were under way; the times on the screen change all the same
press g
wait_for 20 says 'off)$'; back=$?
stop_program

job "shows a picture" "cat '$work/said'; [ $shown = 0 ]"
job "prints what relighting takes" "tail -n 1 '$work/said' | sed 's/^/note: /'; [ $told = 0 ]"
job "the light moves by itself" "[ $moving = 0 ]"
job "key G: the vertex shader shades" "[ $shader = 0 ]"
job "key G again: it does not" "[ $back = 0 ]"
job "Escape ends it with status 0" "cat '$work/said'; [ '$left $status' = '0 0' ]"
job_fails "without a display it fails and says why" "env -u DISPLAY -u WAYLAND_DISPLAY '$hao' '$mesh'" display

# Both kinds of shading; in the pixels of a picture the two are within a little of one another.
for glsl in 0 1; do
    env -u DISPLAY -u WAYLAND_DISPLAY "$hao" "$mesh" --material skimmilk --size-mm 20 --glsl $glsl \
        --headless "$work/strip$glsl.png" >"$work/strip$glsl.said" 2>&1
    echo $? >>"$work/strip$glsl.said"
    job "--headless, --glsl $glsl: needs no display, writes a picture, prints three places" "
        cat '$work/strip$glsl.said'; [ \$(tail -n 1 '$work/strip$glsl.said') = 0 ] &&
        [ \$(wc -c <'$work/strip$glsl.png') -gt 100000 ] && [ \$(grep -c '^relit' '$work/strip$glsl.said') = 3 ]"
done
if have compare; then
    job "both look the same" "
        for i in 0 1; do convert '$work/strip'\$i.png -crop 730x245+0+0 +repage '$work/views'\$i.png; done
        compare -metric RMSE '$work/views0.png' '$work/views1.png' null: 2>'$work/rmse'
        sed 's/.*(\(.*\))/note: RMSE \1/' '$work/rmse'; echo
        awk -F'[()]' '{ exit !(\$2 < 0.004) }' '$work/rmse'"
else skip "both look the same" "no ImageMagick"
fi
job_fails "a mesh that is not there" "'$hao' '$work/absent.glb' --headless '$work/no.png'" 'cannot open'
job_fails "an unknown material" "'$hao' '$mesh' --material plywood --headless '$work/no.png'" plywood
job_fails "a size of 0" "'$hao' '$mesh' --size-mm 0 --headless '$work/no.png'" usage
job_fails "an option without its value" "'$hao' --headless" usage
job_fails "an unknown option" "'$hao' --frobnicate 3" usage
job_fails "a picture that cannot be written" "'$hao' '$mesh' --headless '$work/absent/no.png'" 'cannot write'

jobs_end
