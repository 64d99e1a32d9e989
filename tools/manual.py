#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Generates the manual pages and the completions for bash, zsh and fish from the command's registry of actions.

manual.py COMMAND VERSION FOLDER writes man/man1/curlew.1, one curlew-ACTION.1 for each action, and completions/.
The build runs it, and `cmake --install` puts the files in place.
"""

import json
import subprocess
import sys
from pathlib import Path


def roff(text):
    """Escapes text for troff."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    text = "".join(c if c.isascii() else f"\\[u{ord(c):04X}]" for c in text)
    return "\n".join("\\&" + line if line[:1] in (".", "'") else line for line in text.split("\n"))


def kinds(port):
    """Describes the kinds of an input or output."""
    names = {"levelSet": "level set"}
    return " or ".join(names.get(kind, kind) for kind in port["kinds"])


def value(option):
    """Returns the placeholder for an option's value."""
    if option["choices"]:
        return "|".join(option["choices"])
    return {"real": "number", "integer": "integer", "flag": "0|1", "vector": "x,y,z", "coordinates": "x,y,...",
            "interval": "lower,upper", "box": "xmin,ymin,zmin,xmax,ymax,zmax",
            "length": "number or 5%"}.get(option["type"], option["type"])


def option_part(option):
    help_text = option["help"]
    if option["unit"]:
        help_text += f" [{option['unit']}]"
    if option["default"] and "(default" not in help_text:
        help_text += f" (default: {option['default']})"
    choices = roff(value(option)).replace("|", "|\\:")  # a line may break after |
    return f".TP\n.BI {roff(option['name'])}= \"{choices}\"\n{roff(help_text)}\n"


def ports(title, found):
    if not found:
        return ""
    return f".PP\n{title}: " + roff(", ".join(f"{port['name']} ({kinds(port)})" for port in found)) + "\n"


def head(name, summary, version):
    return (f'.TH {name.upper()} 1 "" "curlew {version}" "User Commands"\n'
            f".SH NAME\n{roff(name)} \\- {roff(summary)}\n")


def examples(lines):
    return "".join(f".PP\n.nf\n{roff(line)}\n.fi\n" for line in lines)


def action_page(action, version):
    """Returns the page of one action."""
    name = action["name"]
    parts = [head(f"curlew-{name}", action["summary"], version), f".SH SYNOPSIS\n.B curlew \\-{roff(name)}\n"]
    if action["positional"]["what"]:
        parts.append(f".I {roff(action['positional']['what'])}\n")
    if action["options"]:
        parts.append(".RI [ option = value \" ...]\"\n")
    parts.append(f".SH DESCRIPTION\n{roff(action['summary'][:1].upper() + action['summary'][1:])}.\n")
    if action["details"]:
        parts.append(f".PP\n{roff(action['details'][:1].upper() + action['details'][1:])}.\n")
    parts += [ports("Takes", action["inputs"]), ports("Makes", action["outputs"])]
    if action["options"]:
        parts.append(".SH OPTIONS\n")
        parts += [option_part(option) for option in action["options"]]
    if action["examples"]:
        parts.append(".SH EXAMPLES\n" + examples(action["examples"]))
    parts.append(".SH SEE ALSO\n.BR curlew (1)\n")
    return "".join(parts)


def command_page(actions, version):
    """Returns the page of the command: its syntax, and its actions by group."""
    parts = [head("curlew", "divergence-free vector noise for visual effects", version),
             ".SH SYNOPSIS\n.B curlew\n.RI [ -action \" [\" option=value \" ...] ...]\"\n",
             ".SH DESCRIPTION\n"
             "Makes velocity fields without a fluid solver, and moves particles along them without leaks into obstacles.\n"
             "Actions run from left to right on stacks of fields, flows, grids, points, curves, meshes and images. An action takes\n"
             "the newest objects of the kinds that it needs and puts its result on top.\n"
             ".PP\nNames of options may be shortened to a unique prefix.\n"
             ".I as=NAME\nnames a result, and every input can be given by name:\n.IR \"\\-advect flow=wind\" .\n"
             ".I {2*pi*T}\nin a value is an expression; T is the time of a frame.\n"
             ".SH EXAMPLE\n",
             examples(["curlew -read spot.obj -mesh2ls -noise seed=1 -noise seed=2 -bound -dfvn speed=1 -velocity -write vel.vdb"]),
             ".SH ACTIONS\nEach has a page of its own, curlew\\-ACTION(1).\n"]
    for group in dict.fromkeys(action["group"] for action in actions):
        parts.append(f".SS {roff(group)}\n")
        parts += [f".TP\n.B \\-{roff(action['name'])}\n{roff(action['summary'])}\n"
                  for action in actions if action["group"] == group]
    parts.append(".SH EXIT STATUS\n0 if all went well, 1 after an error, 130 after an interrupt.\n"
                 ".SH FILES\nA file is written whole or not at all.\n")
    return "".join(parts)


def words(actions):
    """Returns the words that can follow each action, and the choices of each of its options."""
    options = {action["name"]: [f"{option['name']}=" for option in action["options"]] for action in actions}
    choices = {(action["name"], option["name"]): option["choices"] or ["0", "1"]
               for action in actions for option in action["options"] if option["choices"] or option["type"] == "flag"}
    return options, choices


def shell_case(lines):
    return "\n".join(f"        {pattern}) echo '{' '.join(found)}' ;;" for pattern, found in lines)


def tables(actions):
    """Returns the tables of words as two shell functions, in the syntax that bash and zsh share."""
    options, choices = words(actions)
    return f"""_curlew_options() {{
    case $1 in
{shell_case((f"-{name}", found) for name, found in options.items())}
    esac
}}

_curlew_choices() {{
    case $1 in
{shell_case((f"-{action}:{option}", found) for (action, option), found in choices.items())}
    esac
}}
"""


def bash(actions):
    return f"""# Completion of curlew for bash; made from its actions.
{tables(actions)}
_curlew() {{
    local action='' name='' typed=${{COMP_WORDS[COMP_CWORD]}} i
    COMPREPLY=()
    # Bash takes = for a word of its own.
    if [[ $typed == '=' ]]; then
        name=${{COMP_WORDS[COMP_CWORD - 1]}} typed=''
    elif [[ ${{COMP_WORDS[COMP_CWORD - 1]}} == '=' ]]; then
        name=${{COMP_WORDS[COMP_CWORD - 2]}}
    fi
    for ((i = COMP_CWORD - 1; i > 0; --i)); do
        if [[ ${{COMP_WORDS[i]}} == -[a-zA-Z]* ]]; then action=${{COMP_WORDS[i]}} && break; fi
    done
    if [[ -n $name ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(_curlew_choices "$action:$name")" -- "$typed")
        ((${{#COMPREPLY[@]}})) || mapfile -t COMPREPLY < <(compgen -f -- "$typed")
    elif [[ $typed == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "{' '.join('-' + action['name'] for action in actions)}" -- "$typed")
    else
        mapfile -t COMPREPLY < <(compgen -W "$(_curlew_options "$action")" -- "$typed")
        if ((${{#COMPREPLY[@]}})); then
            compopt -o nospace 2>/dev/null
        else
            mapfile -t COMPREPLY < <(compgen -f -- "$typed")
        fi
    fi
}}
complete -o filenames -F _curlew curlew
"""


def zsh(actions):
    described = "\n".join(f"        '-{action['name']}:{quoted(action['summary'])}'" for action in actions)
    return f"""#compdef curlew
# Completion of curlew for zsh; made from its actions.
{tables(actions)}
_curlew() {{
    local action='' i
    local -a known
    for ((i = CURRENT - 1; i > 1; --i)); do
        if [[ $words[i] == -[a-zA-Z]* ]]; then action=$words[i]; break; fi
    done
    if [[ $PREFIX == -* ]]; then
        known=(
{described}
        )
        _describe action known
    elif [[ $PREFIX == *=* ]]; then
        known=(${{=$(_curlew_choices "$action:${{PREFIX%%=*}}")}})
        compset -P '*='
        if (( $#known )); then compadd -a known; else _files; fi
    else
        known=(${{=$(_curlew_options "$action")}})
        compadd -S '' -a known
        _files
    fi
}}
_curlew "$@"
"""


def quoted(text):
    """Escapes text for single quotes, and removes colons, which separate a name from its description."""
    return text.replace("'", "'\\''").replace(":", "\\:")


def fish(actions):
    options, choices = words(actions)
    lines = ["# Completion of curlew for fish; made from its actions.",
             "function __curlew_action",
             "    for word in (commandline -opc)[-1..1]",
             "        if string match -qr '^-[a-zA-Z]' -- $word",
             "            echo $word",
             "            return",
             "        end",
             "    end",
             "end",
             "function __curlew_words",
             "    switch (__curlew_action)"]
    for name, found in options.items():
        every = [option if (name, option[:-1]) not in choices else "" for option in found]
        every += [f"{option}={choice}" for (action, option), values in choices.items() if action == name for choice in values]
        if any(every):
            lines += [f"        case -{name}", f"            printf '%s\\n' {' '.join(word for word in every if word)}"]
    lines += ["    end", "end", "complete -c curlew -a '(__curlew_words)'"]
    for action in actions:
        summary = action["summary"].replace("\\", "\\\\").replace("'", "\\'")
        lines.append(f"complete -c curlew -o {action['name']} -d '{summary}'")
    return "\n".join(lines) + "\n"


def main(command, version, folder):
    listed = subprocess.run([command, "-list", "format=json"], check=True, capture_output=True, text=True)
    actions = json.loads(listed.stdout)["actions"]
    files = {"man/man1/curlew.1": command_page(actions, version),
             "completions/bash/curlew": bash(actions),
             "completions/zsh/_curlew": zsh(actions),
             "completions/fish/curlew.fish": fish(actions)}
    files |= {f"man/man1/curlew-{action['name']}.1": action_page(action, version) for action in actions}
    for name, text in files.items():
        path = Path(folder) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
