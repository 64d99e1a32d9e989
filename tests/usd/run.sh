#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs readers_test.mjs: run.sh COMMAND MODULES_DIR. Exits with 77 (skipped) if Node.js or the modules are not installed.
set -eu
if ! command -v node > /dev/null; then
    echo "skipped: there is no Node.js here (node, npm)"
    exit 77
fi
if ! [ -d "$2/tinyusdz" ] || ! [ -d "$2/three" ]; then
    echo "skipped: the readers are not in $2 (./dev test installs them)"
    exit 77
fi
exec node "$(dirname "$0")/readers_test.mjs" "$1" "$2"
