#!/bin/sh
# Brings the files of truth up to date (those that are stay), with isotropic scattering for every case and with
# g = 0.8 for some, and writes README.md from them and from verify.csv.
#   tests/chart/truth/truth.sh            all that is missing or out of date; minutes of processor time for a case
#   tests/chart/truth/truth.sh --verify   the layers and rings of known reflectance anew: verify.csv
#   tests/chart/truth/truth.sh --readme   prints README.md from what is there
cd "$(dirname "$0")/../../.." || exit 1
program=build/tests/chart/truth
here=tests/chart/truth
anisotropic="bunny-skimmilk-50-front leaf-skin1-50-behind sphere-ketchup-20-side"

# How many rows of verify.csv lie within 2 and within 4 standard errors + 0.1 % (rings: MCML's 0.3 %, case H 0.5 %, and
# both errors), and the mean and the mean square of the differences in standard errors.
summary() # pattern of the first column, label
{
    awk -F, -v pattern="$1" -v label="$2" '
        function distance(x) { return x < 0 ? -x : x }
        $1 ~ pattern {
            error = $10 > 0 ? $10 : 1e-12
            if ($11 != 0 && $1 ~ /MCML/) error = distance(($9 - $8)/$11)
            allowed = $1 !~ /MCML/ ? 1e-3 : $1 ~ /case H/ ? 5e-3 : 3e-3
            digits = $1 ~ /exact/ ? 5e-8 : $1 ~ /MCML/ ? 5e-7 : $6 == 0 ? 2e-5 : 5e-6
            away = distance($9 - $8) - allowed*$8 - digits
            two += away <= 2*error; four += away <= 4*error; n++
            sum += $11; squares += $11*$11
            relative = $8 > 1e-3 ? distance($12) : 0
            if (relative > worst) worst = relative
        }
        END { printf "| %s | %d | %d | %d | %+.2f | %.2f | %.2f %% |\n", label, n, two, four, sum/n, squares/n,
                     100*worst }' $here/verify.csv
}

# The table, with the rows of README.md for cases whose mesh is not there.
table()
{
    $program --table >build/truth-table || return 1
    awk -v old=$here/README.md '
        function name(row) { sub(/^[|] /, "", row); sub(/ .*/, "", row); return row }
        BEGIN { while ((getline row <old) > 0) if (row ~ /^[|] /) rows[name(row)] = row }
        / no mesh / && name($0) in rows { print rows[name($0)]; next }
        { print }' build/truth-table
}

readme()
{
    cat <<'END'
# Truth: the chart's cases by random walk

Written by `make truth`. Each file holds the mean radiosity of about 200 patches of a case's mesh, computed without the
dipole model: photons enter with the dipole's own irradiance (vertex normals, no shadows, entering Fresnel), are
refracted, scatter inside the closed mesh and leave through a Fresnel boundary. tests/common/walk.h says what is
computed and how, tests/common/truth.h how a method's result is compared with a file: relative L2 error over patches,
the variance of the noise subtracted. Files are refused when mesh, size, material, light or settings differ.

`build/tests/chart/truth --table`: the flux that leaves over what entered; photons and the standard error of the whole,
relative to its L2 norm; the share of what entered that fell through faults of the mesh (three triangles of the bunny
are folded; the dragon has many such places); how far Henyey and Greenstein's scattering with g = 0.8 at the same
reduced coefficients is from isotropic.

END
    table || exit 1
    cat <<'END'

## Verification

`build/tests/chart/truth --verify tests/chart/truth/verify.csv`, every row of it: the same walk in a wide closed box
against exact half spaces, adding-doubling and van de Hulst's slabs (normal, oblique and Lambertian incidence, g from 0
to 0.9), allowing 0.1 % beyond the standard errors; and against MCML's rings about a beam, allowing what its own totals
are low by (0.3 %, case H 0.5 %). z: difference in standard errors. The largest relative difference is of values above
0.001.

| against | numbers | within 2 standard errors | within 4 | mean z | mean z^2 | largest difference |
|---|---|---|---|---|---|---|
END
    summary '^1[.]2' 'exact half spaces'
    summary '^1[.][34]|^1[.]1' 'adding-doubling, van de Hulst'
    summary '^1[.]5' 'MCML, rings'
}

case ${1:-} in
    --readme) readme ;;
    --verify) $program --verify $here/verify.csv --photons 150000 && readme >build/truth.md &&
              mv build/truth.md $here/README.md ;;
    '') $program --all --noise 0.02 --steps 2.5e8 && $program --g 0.8 --noise 0.025 --steps 2.5e8 $anisotropic &&
        readme >build/truth.md && mv build/truth.md $here/README.md ;;
    *) sed -n '2,6s/^# *//p' "$0" >&2; exit 2 ;;
esac
