# SPDX-License-Identifier: Apache-2.0
"""Builds the documentation site in a temporary folder and checks its pages. run.py FOLDER checks an existing site.

If CURLEW_COMMAND names the command, each action must have a page with all of its options, to which the table of actions links.
Every link and picture of a page must lead to a file of the site, and every #anchor to an id in the page. No page may load
anything from another site. Exits with 77 (skipped) if MkDocs is not installed.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parents[2]
LOADED = {("link", "href"), ("script", "src"), ("img", "src"), ("iframe", "src"), ("source", "src"), ("video", "src")}


class Page(HTMLParser):
    """Collects the links of a page, the files that it loads, and the anchors in it."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.places = [], [], {"", "top"}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or (tag == "a" and name == "name"):
                self.places.add(value)
            elif (tag, name) in LOADED:
                self.loads.append(value)
            elif (tag, name) == ("a", "href"):
                self.links.append(value)


def problems(folder):
    """Returns the errors of the site, one per line, and the numbers of its pages and links."""
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    wrong, count = [], 0
    for path, page in pages.items():
        name = path.relative_to(folder)
        for link in page.loads + page.links:
            count += 1
            url = urlsplit(link)
            if url.scheme == "data":
                continue
            if url.scheme or url.netloc:
                if link in page.loads:
                    wrong.append(f"{name} loads {link}")
                continue
            base = folder if url.path.startswith("/") else path.parent
            there = (base / unquote(url.path).lstrip("/")).resolve() if url.path else path
            if there == folder.resolve():
                there /= "index.html"
            if not there.is_file() or folder.resolve() not in there.parents:
                wrong.append(f"{name}: {link} does not exist")
            elif there.suffix == ".html" and unquote(url.fragment) not in pages[there].places:
                wrong.append(f"{name}: {link} has no such anchor")
    for style in sorted(folder.rglob("*.css")):
        for link in re.findall(r"(?:url\(|@import )\s*['\"]?((?:https?:)?//[^'\")]+)", style.read_text(encoding="utf-8")):
            wrong.append(f"{style.relative_to(folder)} loads {link}")
    return wrong, len(pages), count


def missing_help(folder, command):
    """Returns the actions and options of the command that the site does not explain, one per line."""
    listed = subprocess.run([command, "-list", "format=json"], check=True, capture_output=True, text=True)
    table, wrong = Page(folder / "actions.html"), []
    for action in json.loads(listed.stdout)["actions"]:
        path = folder / f"actions/{action['name']}.html"
        if f"actions/{action['name']}.html" not in table.links or not path.is_file():
            wrong.append(f"actions.html does not lead to a page of -{action['name']}")
            continue
        text, places = unescape(re.sub("<[^>]*>", "", path.read_text(encoding="utf-8"))), Page(path).places
        said = [action["details"], *action["examples"], *(option["default"] for option in action["options"])]
        wrong += [f"actions/{action['name']}.html does not say '{one}'" for one in said if one[1:].rstrip(".") not in text]
        wrong += [f"actions/{action['name']}.html lacks {option['name']}=" for option in action["options"]
                  if option["name"] not in places or option["help"][1:].rstrip(".") not in text or option["unit"] not in text]
    return wrong


def check(folder):
    """Returns the argument of sys.exit(): 0, or the errors."""
    wrong, pages, links = problems(folder)
    if os.environ.get("CURLEW_COMMAND"):
        wrong += missing_help(folder, os.environ["CURLEW_COMMAND"])
    print(f"site: {pages} pages with {links} links and files")
    if pages == 0:
        wrong.append("there are no pages")
    return "\n".join(wrong) or 0


def main(check, folder=None):
    """Returns what check() returns for the site in `folder`, or in a temporary folder where it is built."""
    if folder:
        return check(Path(folder).resolve())
    mkdocs = shutil.which("mkdocs")
    if not mkdocs:
        print("skipped: there is no MkDocs here (apt-get install mkdocs)")
        return 77
    with tempfile.TemporaryDirectory() as scratch:
        built = subprocess.run([mkdocs, "build", "--strict", "-f", ROOT / "tools/site/mkdocs.yml", "-d", scratch],
                               capture_output=True, text=True)
        if built.returncode != 0:
            return f"mkdocs ended with {built.returncode}:\n{built.stdout}{built.stderr}"
        return check(Path(scratch).resolve())


if __name__ == "__main__":
    sys.exit(main(check, *sys.argv[1:]))
