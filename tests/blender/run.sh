#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs one of these tests in Blender, with the packed add-on and a separate configuration:
#   run.sh TEST.py SOURCE_DIR PACKAGES_DIR COMMAND WORK_DIR
# Exits with 77 (skipped) if Blender is not installed.
set -eu
test=$1 source=$2 packages=$3 command=$4 work=$5
blender=${CURLEW_BLENDER:-blender}
if ! command -v "$blender" > /dev/null; then
    echo "skipped: there is no Blender here (apt-get install blender libegl1 python3-numpy)"
    exit 77
fi
rm -rf "$work" && mkdir -p "$work/scripts/addons" "$work/config"
export BLENDER_USER_SCRIPTS="$work/scripts" BLENDER_USER_CONFIG="$work/config"
export CURLEW_COMMAND="$command" CURLEW_WORK="$work" CURLEW_SOURCE="$source" CURLEW_PACKAGES="$packages"
export PYTHONDONTWRITEBYTECODE=1
PATH=/usr/bin:/bin:$PATH # Debian's Blender takes its modules from beside the first python3, which may be that of a virtual environment
exec "$blender" --background --factory-startup -noaudio --python-exit-code 3 --python "$source/tests/blender/$test"
