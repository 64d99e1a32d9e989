# SPDX-License-Identifier: Apache-2.0
# run.sh FOLDER: checks that groff accepts the manual pages without warnings, and tests the completions in each shell.
set -eu
cd "$1"

fail() {
    printf '%s\n' "$*" >&2
    exit 1
}

# expect WHAT FOUND WORD...: fails unless each word is a line of FOUND.
expect() {
    local what=$1 found=$2 word
    shift 2
    for word; do grep -qxF -e "$word" <<<"$found" || fail "$what: no '$word' in: $found"; done
}

for page in man/man1/*.1; do
    said=$(groff -man -Tutf8 -ww -z "$page" 2>&1)
    [[ -z $said ]] || fail "$page: $said"
done
groff -man -Tutf8 -P-cbou man/man1/curlew-bound.1 | grep -q 'separate=0|1' || fail 'no options in curlew-bound.1'

# completed WORD...: prints bash's completions of the last word of a command line, given as split by bash.
completed() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _curlew
    printf '%s\n' "${COMPREPLY[@]}"
}
source completions/bash/curlew
expect bash "$(completed curlew -bo)" -bound -box
expect bash "$(completed curlew -sphere -bound s)" side= separate=
expect bash "$(completed curlew -bound side = o)" outside
expect bash "$(completed curlew -bound side =)" inside outside both
mkdir -p files && touch files/a.obj
expect bash "$(completed curlew -read files/a)" files/a.obj

fish=$(fish --no-config -c 'source completions/fish/curlew.fish; complete -C "curlew -sphere -bound s"; complete -C "curlew -boun"')
expect fish "$(cut -f1 <<<"$fish")" side=outside separate=1 -bound

zsh -f -n completions/zsh/_curlew
zsh -f -c 'function _describe() {}; function compadd() { print -l -- ${(P)@[-1]} }; CURRENT=3; PREFIX=s; words=(curlew -bound s)
    function _files() {}; source completions/zsh/_curlew' >files/zsh
expect zsh "$(cat files/zsh)" side= separate=
rm -r files
