# SPDX-License-Identifier: Apache-2.0
"""What MkDocs does not do by itself for our site: pages from outside docs/, links to source files, blank lines before lists, names
of actions on one line.

The README is the home page. Other pages outside docs/ and the files that pages link to keep their paths in the site; a file that a
browser would not show gets .txt behind its name. Links in the pages are those of the repository, so that they work there, too.

Each action gets a page, made by the command that CURLEW_COMMAND names, or else by build/curlew; without a command, there are none.
The command also makes the page that shows a flow in the browser, as docs/shaders.md says; the picture there leads to it.
"""

import logging
import os
import posixpath
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

from mkdocs.structure.files import File

sys.path.append(str(Path(__file__).resolve().parent))
import actions  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
COMMAND = Path(os.environ.get("CURLEW_COMMAND") or ROOT / "build/curlew")
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "scenes/README.md")  # outside docs/
SHOWN = {".txt", ".json", ".csv", ".png", ".svg"}  # by browsers
LINK = re.compile(r"(\]\()([^)\s]+)(\))")
ACTION = re.compile(r"(?<![^\s(])--?[A-Za-z][\w-]*")
LIST = re.compile(r"([-*]|\d+\.) ")

LIVE = "look.html"  # the page that a command in docs/shaders.md writes

reference = {}  # the pages of the actions: path in the site, Markdown
scratch = tempfile.TemporaryDirectory()  # for LIVE, until the site is built
log = logging.getLogger("mkdocs.hooks.curlew")  # --strict counts its warnings


def is_local(link):
    """Whether a link leads to a file: not into the page itself, nor to another site."""
    return not re.match(r"#|[a-z]+:", link)


def outside_code(text, change):
    """The page with change() applied to its paragraphs, not to code."""
    parts = re.split(r"(^```.*?^```$|`[^`\n]+`)", text, flags=re.M | re.S)
    return "".join(part if k % 2 else change(part) for k, part in enumerate(parts))


def in_repository(page):
    """The path of a page in the repository, by its path in the site."""
    return page if page in PAGES else posixpath.join("docs", page)


def target(page, link):
    """The file of the repository that a link in a page of the repository leads to."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), unquote(link.partition("#")[0])))


def in_site(path):
    """Where a file of the repository is in the site."""
    if path.startswith("docs/"):
        return path[len("docs/"):]
    return path if path in PAGES or Path(path).suffix in SHOWN else path + ".txt"


def links(text):
    """All links of a page to files."""
    found = []
    outside_code(text, lambda part: found.extend(m[2] for m in LINK.finditer(part) if is_local(m[2])) or part)
    return found


def file(config, name, source):
    """A file of the site that lies elsewhere."""
    result = File(name, str(ROOT), config["site_dir"], config["use_directory_urls"])
    result.abs_src_path = str(source)
    return result


def made_live():
    """Runs the command of docs/shaders.md and returns the page that it writes."""
    text = (ROOT / "docs/shaders.md").read_text(encoding="utf-8")
    words = shlex.split(re.search(rf"^```sh\ncurlew ([^`]*-write {LIVE})\n```$", text, flags=re.M)[1].replace("\\\n", " "))
    made = Path(scratch.name) / LIVE
    subprocess.run([COMMAND, "-quiet", *words[:-1], made], cwd=ROOT, check=True)
    return made


def on_files(files, config):
    """Adds the pages and the linked files that are not in docs/, and the pages of the actions."""
    for name in PAGES:
        files.append(file(config, name, ROOT / name))
    for page in [p.src_uri for p in files.documentation_pages()]:
        path = in_repository(page)
        for link in links((ROOT / path).read_text(encoding="utf-8")):
            found = target(path, link)
            if not found.startswith("docs/") and (ROOT / found).is_file() and not files.get_file_from_path(in_site(found)):
                files.append(file(config, in_site(found), ROOT / found))
    if COMMAND.is_file():
        reference.update(actions.pages(COMMAND))
        files.append(file(config, LIVE, made_live()))
    else:
        log.info("there is no command '%s': the actions have no pages, and no flow moves", COMMAND)
    for name in reference:
        files.append(file(config, name, ROOT / "docs" / name))
    for name in ("css/site.css", "js/site.js"):
        files.append(file(config, name, Path(__file__).with_name(Path(name).name)))
    # Debian's theme refers to files that it lacks: a jQuery with another name than its own, a script, and in Debian 13 the fonts,
    # which are next to the style sheet that the theme's is a link to.
    themes = [Path(folder) for folder in config["theme"].dirs]
    asked = {"js/theme_extra.js": Path(__file__).with_name("theme_extra.js")}
    for theme in themes:
        asked.update({"js/jquery-3.6.0.min.js": jquery for jquery in theme.glob("js/jquery*.min.js")})
        asked.update({f"fonts/{font.name}": font for font in (theme / "css/theme.css").resolve().parents[1].glob("fonts/*")})
    for name, source in asked.items():
        if not any((theme / name).exists() for theme in themes):
            files.append(file(config, name, source.resolve()))
    return files


def on_page_read_source(page, config):
    """The text of a page that is not a file; None for the others."""
    return reference.get(page.file.src_uri)


def with_live(text, files):
    """The page about shaders, whose picture leads to the page that moves."""
    if not files.get_file_from_path(LIVE):
        return text
    return re.sub(r"!\[[^]]*\]\(look\.png\)", rf"[\g<0>]({LIVE})\n\n[Open this page: it moves, and turns with the mouse.]({LIVE})", text)


def with_actions(table):
    """The table of actions with a link to the page of each."""
    row = re.compile(r"^\| `-(\w+)` \|", re.M)
    return row.sub(lambda m: f"| [`-{m[1]}`](actions/{m[1]}.md) |" if f"actions/{m[1]}.md" in reference else m[0], table)


def on_page_markdown(markdown, page, config, files):
    """Turns links of the repository into those of the site; Python-Markdown wants a blank line before a list."""
    if page.file.src_uri in reference:
        return markdown
    path = in_repository(page.file.src_uri)

    def rewritten(match):
        if not is_local(match[2]):
            return match[0]
        found, anchor = target(path, match[2]), match[2].partition("#")[1:]
        if not (ROOT / found).is_file():
            log.warning("%s: there is no file '%s'", path, match[2])
        there = posixpath.relpath(in_site(found), posixpath.dirname(page.file.src_uri) or ".")
        return match[1] + there + "".join(anchor) + match[3]

    lines, code = [], False
    for line in outside_code(markdown, lambda part: LINK.sub(rewritten, part)).split("\n"):
        code ^= line.startswith("```")
        if not code and LIST.match(line) and lines and lines[-1] and not re.match(r"\s|[-*] |\d+\. ", lines[-1]):
            lines.append("")
        lines.append(line)
    changed = "\n".join(lines)
    if path == "docs/shaders.md":
        return with_live(changed, files)
    return with_actions(changed) if path == "docs/actions.md" else changed


def on_page_content(html, page, config, files):
    """Keeps browsers from breaking a line after the hyphen of an action, as in -bound."""
    parts = re.split(r"(<pre.*?</pre>|<[^>]*>)", html, flags=re.S)
    return "".join(part if k % 2 else ACTION.sub(r'<span class="action">\g<0></span>', part) for k, part in enumerate(parts))
