#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a scene with the values of its line "# reduced:" in a new folder: run.sh CURLEW SCENE. The scene must succeed,
# including its -expect actions, and must create out/ and write files to it.
set -eu
fail() {
    echo "$scene: $*" >&2
    exit 1
}
curlew=$1
scene=$2
reduced=$(sed -n 's/^# reduced:[[:space:]]*//p' "$scene")
[ -n "$reduced" ] || fail "has no line '# reduced: scale=…', with the values for tests"
for part in '# [^ ].*' '# source: .*'; do grep -q "^$part" "$scene" || fail "has no line '$part'"; done
grep -Eq '^-?expect ' "$scene" || fail "expects nothing: end it with an expect of what it is about"

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
ln -s "$(cd "$(dirname "$scene")" && pwd)" "$folder/scenes"
cd "$folder"
# shellcheck disable=SC2086  # the values are words
"$curlew" -set $reduced -config "scenes/$(basename "$scene")"
[ -n "$(ls out)" ] || fail "has written nothing into out/"
