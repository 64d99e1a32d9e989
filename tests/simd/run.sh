#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# run.sh OBJECT...: disassembles what is compiled for AVX-512, and fails if a function uses it but has no Avx512 in its name.
# The linker keeps only one copy of an inline function. If that copy comes from a *Kernels.cpp file, most processors cannot
# run it. Exits with 77 (skipped) if objdump is not installed.
set -eu
if [ $# -eq 0 ]; then
    echo "usage: run.sh OBJECT..." >&2
    exit 2
fi
if ! command -v objdump >/dev/null; then
    echo "skipped: there is no objdump; it comes with binutils"
    exit 77
fi

status=0
for file in "$@"; do
    # An AVX-512 instruction begins with the byte 62 (EVEX), possibly after address prefixes, or uses a mask register.
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
            exit wrong > 0 || right == 0 # if no kernel uses AVX-512, the search itself is broken
        }' || status=1
done
exit $status
