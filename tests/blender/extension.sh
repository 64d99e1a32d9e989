#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tests the add-on in a Blender that has extensions (4.2 and later): extension.sh SOURCE_DIR PACKAGES_DIR WORK_DIR [TEST]...
# Validates the extension, installs it and quits 12 times, and runs these tests or all. Prints a line for each. Fails if one
# fails. The library needs nothing of the system, so it may have been built on another.
set -eu
source=$1 packages=$2 work=$3
shift 3
blender=${CURLEW_BLENDER:-blender}
tests=${*:-$(cd "$source/tests/blender" && ls *_test.py | sed 's/_test.py//' | grep -v '^package$')}
rm -rf "$work" && mkdir -p "$work/logs" "$work/wheel"
export PYTHONDONTWRITEBYTECODE=1
failed=0

# run NAME COMMAND...: runs a command with a log, and prints its result and time.
run() {
    name=$1
    shift
    began=$(date +%s)
    if "$@" > "$work/logs/$name.log" 2>&1; then result=passed; else result="FAILED ($?)" failed=$((failed + 1)); fi
    printf '%-16s %s, %s s\n' "$name" "$result" $(($(date +%s) - began))
    case $result in FAILED*) tail -n 30 "$work/logs/$name.log" | sed 's/^/    /' ;; esac
}

install_and_quit() {
    count=0
    for k in $(seq 12); do
        rm -rf "$work/user" && mkdir -p "$work/user/extensions"
        BLENDER_USER_RESOURCES=$work/user "$blender" --factory-startup --command extension install-file -r user_default -e "$extension" &&
            BLENDER_USER_RESOURCES=$work/user timeout 180 "$blender" --background --python-exit-code 3 --python-expr "
import bpy
assert 'bl_ext.user_default.curlew' in bpy.context.preferences.addons
tree = bpy.data.node_groups.new('t', 'CurlewTree')
tree.nodes.new('CurlewNode_noise')" && count=$((count + 1))
    done
    echo "$count of 12 without a crash"
    test "$count" = 12
}

extension=$(ls "$packages"/*-linux-x64.zip)
"$blender" --version | head -n 1
run validate "$blender" --command extension validate "$extension"
run install_quit install_and_quit
# The command, for tests of exported scenes: it is in the wheel.
python3 -m zipfile -e "$extension" "$work/wheel" && python3 -m zipfile -e "$work"/wheel/wheels/*.whl "$work/wheel"
chmod +x "$work/wheel/curlew/curlew"
for test in $tests; do
    run "$test" sh "$source/tests/blender/run.sh" "${test}_test.py" "$source" "$packages" "$work/wheel/curlew/curlew" "$work/$test"
done
echo "$failed failed; logs: $work/logs"
test "$failed" = 0
