#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tries the packages in a folder on a system without Curlew's dependencies, as root: try.sh FOLDER. ./dev try runs it.
# Each package runs -help, the demo at a small size, and an example in Python.
set -eu
cd "$1"
apt="env DEBIAN_FRONTEND=noninteractive apt-get -y -qq -o Dpkg::Use-Pty=0"

say() { printf '== %s\n' "$*"; }

# tried NAME COMMAND PYTHON: runs what a user tries first.
tried() {
    say "$1: -help"
    "$2" -help >/dev/null
    "$2" -version
    mkdir -p "/tmp/try/$1"
    cd "/tmp/try/$1"
    ln -s "$scenes" scenes
    say "$1: the demo"
    # shellcheck disable=SC2046  # the values are words
    "$2" -quiet -set $(sed -n 's/^# reduced:[[:space:]]*//p' scenes/demo.txt) -config scenes/demo.txt
    [ -s out/spot_points.ply ]
    say "$1: an example in Python"
    "$3" "$folder/particles.py"
    [ -s particles.npy ]
    cd "$folder"
}

folder=$PWD
rm -rf /tmp/try
mkdir /tmp/try
$apt update
$apt install --no-install-recommends python3 python3-numpy python3-venv >/dev/null

# The archive, which brings its libraries along.
tar -xf curlew-*.tar.gz -C /tmp/try
top=$(echo /tmp/try/curlew-*)
scenes=$top/share/curlew/scenes
PYTHONPATH=$top/lib/python tried archive "$top/bin/curlew" python3

# The wheel, too.
python3 -m venv --system-site-packages /tmp/try/venv
/tmp/try/venv/bin/pip install -q --no-index --no-deps curlew-*.whl
library=$(/tmp/try/venv/bin/python -c 'import curlew; print(curlew.find_library())')
tried wheel "$(dirname "$library")/curlew" /tmp/try/venv/bin/python

# The Debian package, with the libraries of the system: those of the release that it was made on.
if ! $apt install -s ./curlew_*.deb >/dev/null 2>&1; then
    say "archive and wheel run; the Debian package is for another release"
    exit
fi
$apt install --no-install-recommends ./curlew_*.deb >/dev/null
tried deb curlew python3
$apt purge curlew >/dev/null
[ ! -e /usr/bin/curlew ]
say "all three packages run"
