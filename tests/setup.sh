#!/bin/sh
# Installs the Debian packages that are missing.      tests/setup.sh [--check] build|demo|test
#   build  what examples and tests need to compile;  demo  and the bunny;  test  and every compiler and tool of the gate
# As root, or where sudo asks for no password, it installs; otherwise, and with --check, it prints the command that
# would, and fails. SSS_NO_SETUP=1 skips it, for systems without apt-get where you brought the libraries yourself.
set -eu

check=0
if [ "${1:-}" = --check ]; then check=1; shift; fi
purpose=${1:-test}

build="gcc g++ libc6-dev libglfw3-dev libosmesa6-dev libtinygltf-dev libcglm-dev libstb-dev libembree-dev libcmocka-dev"
demo="glmark2-data gltfpack imagemagick fonts-dejavu-core"
# The 32-bit libraries of the compiler are named after its version.
gcc_version=$(gcc -dumpversion 2>/dev/null | cut -d. -f1)
gate="clang libclang-rt-dev binutils glslang-tools xvfb xauth xdotool gnuplot-nox qemu-user gcc-mingw-w64-x86-64-win32
      gcc-aarch64-linux-gnu libc6-dev-arm64-cross lib32gcc-${gcc_version:-12}-dev libc6-dev-i386"
case $purpose in
    build) wanted=$build ;;
    demo)  wanted="$build $demo" ;;
    test)  wanted="$build $demo $gate" ;;
    *)     echo "setup.sh: unknown purpose '$purpose': build, demo or test" >&2; exit 2 ;;
esac

[ "${SSS_NO_SETUP:-0}" = 1 ] && exit 0
if ! command -v apt-get >/dev/null 2>&1 || ! command -v dpkg-query >/dev/null 2>&1; then
    echo "setup.sh: no apt-get here. Install the equivalents of these Debian packages, then set SSS_NO_SETUP=1:" >&2
    echo "  " $wanted >&2
    exit 1
fi

missing()
{
    for package in $wanted; do
        status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
        # Packages of several architectures answer once each: installed in one is installed.
        case $status in *installed*) [ "$status" = not-installed ] && printf '%s ' "$package" ;;
                        *) printf '%s ' "$package" ;;
        esac
    done
    return 0
}

lacking=$(missing)
[ -z "$lacking" ] && exit 0

command="apt-get update && apt-get install -y --no-install-recommends $lacking"
if [ "$(id -u)" = 0 ]; then as_root=
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then as_root="sudo -n"
else as_root=none
fi
if [ $check = 1 ] || [ "$as_root" = none ]; then
    {
        echo "setup.sh: these packages are missing: $lacking"
        echo "  run as root:  $command"
    } >&2
    exit 1
fi

echo "setup.sh: installing $lacking"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y "$@" </dev/null; }
# A failing update alone is no reason to stop: the lists at hand may be good enough.
apt update >"$log" 2>&1 || tail -n 5 "$log" >&2
if ! apt install --no-install-recommends $lacking >"$log" 2>&1; then
    tail -n 30 "$log" >&2
    echo "setup.sh: installing failed; by hand, as root:  $command" >&2
    exit 1
fi
lacking=$(missing)
[ -z "$lacking" ] || { echo "setup.sh: still missing: $lacking" >&2; exit 1; }
