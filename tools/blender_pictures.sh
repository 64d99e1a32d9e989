#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the pictures in docs/blender anew: blender_pictures.sh PACKAGES [screens | presets | film]...
# PACKAGES: folder of the packed add-on (./dev plugin: out). Needs Blender 3.4, Xvfb and ImageMagick. Presets and films take ten minutes each.
set -euo pipefail
here=$(cd -P "$(dirname "$0")" && pwd)
packages=$1
shift
[[ $# -gt 0 ]] || set -- screens presets film
pages=$here/../docs/blender
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export BLENDER_USER_SCRIPTS=$work/scripts BLENDER_USER_CONFIG=$work/config
mkdir -p "$work/scripts/addons" "$work/config"
python3 -m zipfile -e "$packages"/*-legacy.zip "$work/scripts/addons"
chmod +x "$work/scripts/addons/curlew_blender/curlew/curlew"

# small PICTURE PAGE [OPTION]...: stores a picture with 256 colours.
small() { convert "$1" "${@:3}" -dither None -colors 256 "PNG8:$pages/$2"; }

for what; do
    case $what in
        screens)
            LIBGL_ALWAYS_SOFTWARE=1 timeout 300 xvfb-run -a -s "-screen 0 1600x1000x24" blender --enable-event-simulate --factory-startup \
                -noaudio --window-geometry 0 0 1600 1000 --python "$here/blender_screens.py" -- "$work"
            small "$work/nodes.png" nodes.png -crop 1060x310+265+355 +repage
            small "$work/panel.png" panel.png -crop 1600x720+0+50 +repage -resize 1000x ;;
        presets)
            blender --background --factory-startup --python "$here/blender_pictures.py" -- "$work"
            montage "$work"/{swirl,wind,wake,dust,surface,globe,smoke,shot}.png -tile 4x -geometry 320x240+2+2 -background '#20242a' "$work/sheet.png"
            small "$work/sheet.png" presets.png ;;
        film)
            blender --background --factory-startup --python "$here/blender_pictures.py" -- "$work" --films SWIRL WIND DUST SURFACE GLOBE SMOKE
            for frame in "$work"/swirl.????.png; do
                frame=${frame#"$work"/swirl.}
                montage "$work"/{swirl,wind,dust,surface,globe,smoke}."$frame" -tile 3x -geometry 160x120+1+1 -background '#20242a' "$work/sheet.$frame"
            done
            python3 -B "$here/film.py" "$pages/presets.gif" 12 --small "$work"/sheet.????.png
            python3 -B "$here/film.py" "$pages/skin.gif" 12 "$work"/surface.????.png ;;
        *) echo "blender_pictures.sh: unknown picture '$what'" >&2; exit 1 ;;
    esac
done
