#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# run.sh FILE...: disassembles programs and objects compiled for AVX-512, and fails for functions that use AVX-512 without being made for
# it, which those that are say in their names. The linker keeps one copy of an inline function for everyone: compiled in
# a *Kernels.cpp it could be one that most processors cannot run. Ends with 77 where it cannot tell.
set -eu
if [ $# -eq 0 ]; then
    echo "usage: run.sh FILE..." >&2
    exit 2
fi
if ! command -v objdump >/dev/null; then
    echo "skipped: there is no objdump; it comes with binutils"
    exit 77
fi

status=0
for file in "$@"; do
    # An instruction of AVX-512 begins with the byte 62 (EVEX), maybe after prefixes for the address, or works on a mask.
    LC_ALL=C objdump --disassemble --insn-width=16 "$file" | awk -v file="$file" '
        /^[0-9a-f]+ <.*>:$/ {
            name = substr($2, 2, length($2) - 3)
            made = name ~ /Avx512/
            next
        }
        /^ *[0-9a-f]+:\t((26|2e|36|3e|64|65|67) )*62 / || /%k[0-7]/ {
            if (made) kernels[name]
            else if (!(name in offenders)) offenders[name] = $0
        }
        END {
            for (name in kernels) ++right
            for (name in offenders) {
                ++wrong
                print file ": " name " is for all processors, and uses AVX-512:\n" offenders[name]
            }
            printf "%s: %d functions made for AVX-512 use it, and %d others\n", file, right, wrong
            exit wrong > 0 || right == 0 # none at all would mean that it looks in vain
        }' || status=1
done
exit $status
