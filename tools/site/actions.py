# SPDX-License-Identifier: Apache-2.0
"""Makes the pages of the action reference: one for each action, from the command's registry (curlew -list format=json).

A page is a heading and HTML, because help texts contain characters that mean something in Markdown.
"""

import json
import re
import subprocess
import sys
from html import escape
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.append(str(Path(__file__).resolve().parents[1]))
import manual  # noqa: E402

MENTION = re.compile(r"(?<![\w=&;-])-([A-Za-z]\w*)(?![\w=-])")


def registry(command):
    """Returns the actions of the command."""
    listed = subprocess.run([command, "-list", "format=json"], check=True, capture_output=True, text=True)
    return json.loads(listed.stdout)["actions"]


def sentence(text):
    """Begins with a capital, unless the first word is code, and ends with a full stop."""
    begins = text[:1].upper() + text[1:] if re.match(r"[a-z]+[ ,]", text) else text
    return begins if begins.endswith((".", "!", "?")) else begins + "."


def linked(text, names, own):
    """Escapes a text and links the actions that it mentions, except the page's own."""
    def link(match):
        name = match[1]
        code = f"<code>-{name}</code>"
        return match[0] if name not in names else code if name == own else f'<a href="{name}.html">{code}</a>'
    return MENTION.sub(link, escape(text, quote=False))


def bounds(option):
    """Describes the range of an option's values."""
    lower, upper = option["lower"], option["upper"]
    parts = [] if lower is None else [f"{'above' if option['exclusive'] else 'at least'} {lower:g}"]
    return parts + ([] if upper is None else [f"at most {upper:g}"])


def option_part(option, names, own):
    """Returns an option's entry of the list: name, kind of value, range, unit, default, and help."""
    if option["choices"]:
        kind = "one of " + ", ".join(f"<code>{escape(choice)}</code>" for choice in option["choices"])
    else:
        kind = escape(manual.value(option))
    facts = [kind, *bounds(option)]
    if option["unit"]:
        facts.append(escape(option["unit"]))
    if option["default"]:
        facts.append(f"default <code>{escape(option['default'])}</code>")
    if option["formerly"]:
        facts.append("formerly " + ", ".join(f"<code>{escape(name)}=</code>" for name in option["formerly"]))
    return (f'<dt id="{option["name"]}"><code>{option["name"]}=</code> {"; ".join(facts)}</dt>\n'
            f"<dd>{linked(sentence(option['help']), names, own)}</dd>\n")


def ports(title, found, names, own):
    """Lists inputs or outputs."""
    if not found:
        return ""
    notes = [f" ({linked(port['help'], names, own)})" if port.get("help") else "" for port in found]
    parts = [f"<code>{port['name']}</code>: {escape(manual.kinds(port))}{note}" for port, note in zip(found, notes)]
    return f"<p>{title}: {'; '.join(parts)}.</p>\n"


def page(action, names):
    """Returns the Markdown of an action's page."""
    own = action["name"]
    what = action["positional"]["what"]
    synopsis = f"curlew -{own}{' ' + what if what else ''}{' [option=value …]' if action['options'] else ''}"
    parts = [f"# -{own}\n\n<p>{linked(sentence(action['summary']), names, own)}</p>\n",
             f"<pre><code>{escape(synopsis)}</code></pre>\n"]
    if action["details"]:
        parts.append(f"<p>{linked(sentence(action['details']), names, own)}</p>\n")
    if action["short_name"]:
        parts.append(f"<p>Short: <code>-{action['short_name']}</code>.</p>\n")
    parts += [ports("Takes", action["inputs"], names, own), ports("Makes", action["outputs"], names, own)]
    if action["options"]:
        entries = "".join(option_part(option, names, own) for option in action["options"])
        parts.append(f"\n## Options\n\n<dl>\n{entries}</dl>\n")
    if action["examples"]:
        lines = "".join(f"<pre><code>{escape(line)}</code></pre>\n" for line in action["examples"])
        parts.append(f"\n## Examples\n\n{lines}")
    parts.append('\n<p><a href="../actions.html">All actions</a></p>\n')
    return "".join(parts)


def pages(command):
    """Returns the pages of all actions, by their paths in the site."""
    actions = registry(command)
    names = {action["name"] for action in actions}
    return {f"actions/{action['name']}.md": page(action, names) for action in actions}
