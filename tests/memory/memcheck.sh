#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs the main job, small, under Valgrind's memcheck: memcheck.sh COMMAND MESH. No memory may be read before it is written or outside its
# block, and none lost. Exits with 77 (skipped) if Valgrind is not installed.
# With scalar kernels, because the others also compute the lanes beyond the last position of a batch, and discard the results.
set -eu
command -v valgrind > /dev/null || { echo "skipped: Valgrind is not installed"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
CURLEW_SIMD=scalar valgrind --quiet --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite,indirect \
    --show-leak-kinds=definite,indirect --num-callers=30 \
    "$1" -threads 1 -read "$2" -mesh2ls dim=10 -noise seed=1 -noise seed=2 -bound -dfvn speed=1 \
    -velocity voxel=0.4 staggered=1 -write "$folder/velocity.vdb" \
    -scatter count=8 -advect steps=2 duration=0.2 -write "$folder/points.ply" "$folder/points.vdb"
