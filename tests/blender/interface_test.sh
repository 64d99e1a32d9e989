#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tests the add-on in Blender's interface, on a virtual display: interface_test.sh SOURCE_DIR PACKAGES_DIR COMMAND WORK_DIR
# Exits with 77 (skipped) if Blender, Xvfb or ImageMagick is not installed.
set -eu
source=$1 packages=$2 command=$3 work=$4
blender=${CURLEW_BLENDER:-blender}
for program in "$blender" xvfb-run import; do
    if ! command -v "$program" > /dev/null; then
        echo "skipped: there is no $program here (apt-get install blender libegl1 python3-numpy xvfb xauth imagemagick)"
        exit 77
    fi
done
rm -rf "$work" && mkdir -p "$work/scripts/addons" "$work/config"
export BLENDER_USER_SCRIPTS="$work/scripts" BLENDER_USER_CONFIG="$work/config"
export CURLEW_COMMAND="$command" CURLEW_WORK="$work" CURLEW_SOURCE="$source" CURLEW_PACKAGES="$packages"
export PYTHONDONTWRITEBYTECODE=1
PATH=/usr/bin:/bin:$PATH # as in run.sh
LIBGL_ALWAYS_SOFTWARE=1 timeout 300 xvfb-run -a -s "-screen 0 640x400x24" \
    "$blender" --enable-event-simulate --factory-startup -noaudio --window-geometry 0 0 640 400 --python "$source/tests/blender/interface.py"
cat "$work/interface.txt"
grep -qx fine "$work/interface.txt"
# An empty picture has few colours.
colors=$(identify -format %k "$work/interface.png")
echo "$colors colours in the picture"
test "$colors" -gt 500
