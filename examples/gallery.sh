#!/bin/sh
# Bakes the bunny in four materials and four sizes under one light, and lays the pictures out on one sheet,
# examples/pictures/gallery.png, with diffuse reflection alone in the last column. Before that the objects of build/bem
# that deform, examples/pictures/bem.png, the bunny's texture atlases, examples/pictures/atlas.png, and a light round it
# from integrals kept in three ways, examples/pictures/hao.png.
#   sh examples/gallery.sh
#   Needs build/bake, build/bem, build/atlas, build/hao, build/models/bunny.glb (make demo brings them), ImageMagick and
#   the DejaVu fonts.
set -eu
cd "$(dirname "$0")/.."

out=examples/pictures/gallery.png
work=build/gallery
font=/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf
bold=/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf
for need in build/bake build/bem build/atlas build/hao build/models/bunny.glb; do
    [ -e "$need" ] || { echo "gallery.sh: $need is missing; run: make demo" >&2; exit 1; }
done
if ! command -v convert >/dev/null 2>&1 || ! [ -e $font ] || ! [ -e $bold ]; then
    echo "gallery.sh: run as root:  apt-get install -y --no-install-recommends imagemagick fonts-dejavu-core" >&2
    exit 1
fi
mkdir -p "$work" "$(dirname "$out")"

# ---- objects that deform ----

small="-depth 8 -strip -define png:compression-level=9 -define png:exclude-chunks=date,time"
build/bem --headless "$work/strip.png"
convert "$work/strip.png" $small "$work/bem.png"
mv "$work/bem.png" "$(dirname "$out")/bem.png"

# ---- atlases, one row a method ----

for method in orthographic area convex; do
    build/atlas build/models/bunny.glb --method $method --headless "$work/atlas-$method.png" >"$work/atlas.said"
done
convert "$work/atlas-orthographic.png" "$work/atlas-area.png" "$work/atlas-convex.png" -append -resize 1280x $small \
    "$work/atlas.png"
mv "$work/atlas.png" "$(dirname "$out")/atlas.png"

# ---- a light that circles ----

build/hao build/models/bunny.glb --headless "$work/hao-strip.png" >"$work/hao.said"
convert "$work/hao-strip.png" $small "$work/hao.png"
mv "$work/hao.png" "$(dirname "$out")/hao.png"

# ---- the same light and camera for all ----

# A warm light from behind the ears, a cool one from the side, faint surroundings.
light="--light -0.28,0.57,-0.77,6.0,5.6,5.1 --light -0.9,0.35,0.35,1.0,1.07,1.18 --ambient 0.06,0.066,0.078 --soft 7"
look="--camera 20,8,0.97 --floor 0.4 --background 0.20,0.19,0.18 --roughness 0.33 --exposure 1.12"
width=360 height=360
sizes="10 25 60 150"
diffuse_size=60 # any: without scattering inside, size changes nothing

material()
{
    case $1 in
        marble)   echo "--material marble" ;;
        skimmilk) echo "--material skimmilk" ;;
        skin)     echo "--material skin1" ;;
        jade)     echo "--albedo 0.30,0.52,0.36 --mfp 0.55,0.85,0.60 --eta 1.5" ;; # by eye, not measured
    esac
}
rows="marble skimmilk skin jade"
title_marble="Marble"    source_marble="measured, Jensen 2001"
title_skimmilk="Skim milk" source_skimmilk="measured, Jensen 2001"
title_skin="Skin"      source_skin="measured, Jensen 2001"
title_jade="Jade"      source_jade="by albedo and\nmean free path"

# ---- bake ----

bake() # picture, options...
{
    picture=$1
    shift
    build/bake build/models/bunny.glb --tolerance 0.01 $light $look --resolution ${width}x$height \
        --png "$picture" "$@" 2>"$work/log" || { cat "$work/log" >&2; exit 1; }
}

start=$(date +%s)
for row in $rows; do
    for size in $sizes; do
        echo "gallery: $row, $size mm"
        bake "$work/$row-$size.png" $(material $row) --size-mm $size
    done
    echo "gallery: $row, diffuse only"
    bake "$work/$row-diffuse.png" $(material $row) --size-mm $diffuse_size --method lambert
done

# ---- lay out ----

gap=6 margin=40 names=270 head=170 foot=70 apart=30 # pixels; `apart` sets the last column off
paper='#0e0d0c' ink='#e8e2d8' faint='#8f8880'
columns=5
sheet_width=$((margin + names + columns * width + (columns - 2) * gap + apart + margin))
sheet_height=$((head + 4 * height + 3 * gap + foot))

set -- -size ${sheet_width}x$sheet_height "xc:$paper"
y=$head
for row in $rows; do
    x=$((margin + names))
    for column in $sizes diffuse; do
        [ $column = diffuse ] && x=$((x - gap + apart))
        set -- "$@" "$work/$row-$column.png" -geometry +$x+$y -composite
        x=$((x + width + gap))
    done
    eval "title=\$title_$row source=\$source_$row"
    set -- "$@" -gravity NorthWest -font $bold -pointsize 38 -fill "$ink" -annotate +$margin+$((y + height / 2 - 40)) \
        "$title" -font $font -pointsize 20 -fill "$faint" -annotate +$margin+$((y + height / 2 + 14)) "$source"
    y=$((y + height + gap))
done

set -- "$@" -gravity North
x=$((margin + names))
for column in $sizes diffuse; do
    text="$column mm"
    [ $column = diffuse ] && text="diffuse only" x=$((x - gap + apart))
    set -- "$@" -font $font -pointsize 32 -fill "$ink" \
        -annotate "$(printf '%+d%+d' $((x + width / 2 - sheet_width / 2)) $((head - 54)))" "$text"
    x=$((x + width + gap))
done
set -- "$@" -gravity NorthWest -font $bold -pointsize 38 -fill "$ink" -annotate +$margin+30 \
    "One bunny, one light" -font $font -pointsize 25 -fill "$faint" -annotate +$((margin + 470))+41 \
    "Only the material and the size of the object change. Light enters, scatters inside, leaves elsewhere."
set -- "$@" -gravity SouthWest -font $font -pointsize 21 -fill "$faint" -annotate +$margin+22 \
    "sss_dipole.h, direct gather: every one of 34,835 vertices from every one of 69,666 triangles. \
Each picture is exposed for itself."

convert "$@" $small "$work/gallery.png"
mv "$work/gallery.png" "$out"
echo "gallery: $out, $(($(date +%s) - start)) s"
