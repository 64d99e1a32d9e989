#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs all scenes and the papers' tables; writes docs/gallery.md with its pictures, and docs/paper_tables.md.

./dev gallery runs it and passes on its arguments: --only NAME … renews only those scenes or tables.
"""

import argparse
import json
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PICTURES = DOCS / "gallery"
WIDTH = 640
MOST_BYTES = 250_000  # Limit for a picture in the repository.
MOST_SECONDS = 60  # Limit for a scene.
GROUPS = {"shot": "Shots", "icn": "Improving Curl Noise (ICN)", "dewolf": "DeWolf", "catlike": "Catlike Coding", "psrd": "psrdnoise"}
OTHERS = "Curlew"

GALLERY = """<!-- SPDX-License-Identifier: Apache-2.0 -->
# Gallery

Made by `./dev gallery`. It runs each scene from the top of the checkout with the command below the picture, here {width} pixels
wide (`-set width={width}`). The list after the command gives the values of this run and the bounds that the scene checks.
The last line names the source: a paper ([docs/math.md](math.md) has their titles), or "original" if it reproduces no paper.
"""
TABLES = """<!-- SPDX-License-Identifier: Apache-2.0 -->
# The papers' tables

Made by `./dev gallery` with `build/curlew_paper`. The tables compare the papers' figures with ours, and say where and why they
differ. Times are from the machine that made this page.
"""


@dataclass
class Scene:
    name: str
    title: str
    source: str
    text: str  # Paragraphs.

    @staticmethod
    def read(path):
        header = []
        _licence, *lines = path.read_text().splitlines()
        for line in lines:
            if not line.startswith("#"):
                break
            header.append(line[1:].strip())
        fields = {m[1]: m[2] for m in (re.match(r"(source|reduced): *(.*)", line) for line in header) if m}
        text = "\n".join(line for line in header[1:] if not re.match(r"(source|reduced):", line))
        if not header or not header[0] or "source" not in fields:
            raise ValueError(f"{path.name} needs a title and a line '# source:'")
        return Scene(path.stem, header[0].rstrip("."), fields["source"], text.strip())

    def group(self):
        return GROUPS.get(self.name.split("_")[0], OTHERS)


class Page:
    """A page whose parts are enclosed by comments with their names, so that each can be renewed alone."""

    def __init__(self, path, heading):
        self.path = path
        self.heading = heading
        old = path.read_text() if path.exists() else ""
        self.parts = {m[1]: m[2] for m in re.finditer(r"<!-- (\w+):begin -->\n(.*?)<!-- \1:end -->\n", old, re.S)}

    def write(self, order):
        """Writes the page. order: the names of the parts, with headings between them."""
        lines = [self.heading]
        for name in order:
            if name.startswith("#"):
                lines.append(name + "\n")
            elif name in self.parts:
                lines.append(f"<!-- {name}:begin -->\n{self.parts[name]}<!-- {name}:end -->\n")
        self.path.write_text("\n".join(lines))


def natural(name):
    """Sorts fig2 before fig10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def warn(text):
    print(f"gallery: {text}", file=sys.stderr)


def chosen(pictures):
    """Returns the pictures to show. From frames, whose names differ in the number at the end, selects the first, the
    middle and the last."""
    groups = {}
    for picture in sorted(pictures):
        groups.setdefault(re.sub(r"\d{2,}$", "", picture.stem), []).append(picture)
    found = []
    for frames in groups.values():
        found += frames if len(frames) <= 3 else [frames[0], frames[len(frames) // 2], frames[-1]]
    return found


def keep(pictures):
    """Copies the pictures to docs/gallery/ and returns their names."""
    PICTURES.mkdir(exist_ok=True)
    for picture in pictures:
        data = picture.read_bytes()
        depth = struct.unpack(">IIB", data[16:25])[2]
        if depth != 8:
            warn(f"{picture.name} has {depth} bits per channel, not 8")
        kept = PICTURES / picture.name
        if len(data) > MOST_BYTES:
            image = Image.open(picture).convert("RGB")
            image.quantize(palette=image.quantize(256), dither=Image.Dither.FLOYDSTEINBERG).save(kept, optimize=True)
        if len(data) <= MOST_BYTES or kept.stat().st_size >= len(data):
            shutil.copyfile(picture, kept)
        if kept.stat().st_size > MOST_BYTES:
            warn(f"{picture.name} has {kept.stat().st_size // 1000} KB, more than {MOST_BYTES // 1000}")
    return [picture.name for picture in pictures]


def figures(report):
    """Returns the scene's expectations as a list."""
    lines = {}  # In a sequence, the lines of the last frame.
    for found in report.get("expect", []):
        bounds = [f"{word} {found[key]:.4g}" for key, word in (("min", "at least"), ("max", "at most")) if key in found]
        if "below" in found:
            bounds.append(f"below `{found['below']['figure']}`, {found['below']['value']:.4g}")
        lines[found["figure"], *bounds] = f"- `{found['figure']}` is {found['value']:.4g} ({', '.join(bounds)})"
    return "\n".join(lines.values())


def run_scene(scene, curlew):
    """Runs a scene in a new folder. Returns its part of the page and the names of its pictures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scenes").symlink_to(ROOT / "scenes")
        run = subprocess.run([curlew, "-quiet", "-set", f"width={WIDTH}", "-config", f"scenes/{scene.name}.txt",
                              "-report", "report.json"], cwd=folder, capture_output=True, text=True)
        if run.returncode != 0:
            raise RuntimeError(run.stderr.strip() or f"exit status {run.returncode}")
        names = keep(chosen((folder / "out").glob("*.png")))
        report = json.loads((folder / "report.json").read_text())
    # Frames in one paragraph are side by side in the site.
    pictures = "\n".join(f"![{scene.title}](gallery/{name})" for name in names)
    source = re.sub(r"docs/(\w+\.md)", r"[docs/\1](\1)", scene.source)
    parts = [f"### {scene.title}", scene.text, pictures, f"`curlew -config scenes/{scene.name}.txt`", figures(report),
             f"Source: {source}."]
    return "\n\n".join(part for part in parts if part) + "\n\n", names


def plots(folder, curlew):
    """Draws the curves of the tables to docs/gallery/ and returns the names of the pictures."""
    PICTURES.mkdir(exist_ok=True)
    names = []
    for data in sorted(folder.glob("*.csv")):
        names.append(f"{data.stem}.svg")
        subprocess.run([curlew, "-quiet", "-plot", data, PICTURES / names[-1], f"title={data.stem.replace('_', ' ')}",
                        f"width={WIDTH}", f"height={WIDTH // 2}"], check=True)
    return names


def run_table(name, paper, curlew):
    """Runs a table. Returns its part of the page and the names of its pictures. Fails if a claim does not hold."""
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([paper, name, "--folder", folder], capture_output=True, text=True)
        if run.returncode != 0:
            raise RuntimeError(run.stderr.strip() or f"exit status {run.returncode}")
        drawn = plots(Path(folder), curlew)
        shown = "".join(f"![{Path(svg).stem}](gallery/{svg})\n" for svg in drawn)
        return f"{run.stdout.strip()}\n\n{shown}\n", keep(chosen(Path(folder).glob("*.png"))) + drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="NAME", nargs="+", help="run only these scenes or tables, and keep the others")
    parser.add_argument("--command", default=ROOT / "build/curlew", type=Path, help="the curlew command to run; curlew_paper must be in the same folder")
    options = parser.parse_args()
    command = options.command.resolve()
    paper_command = command.parent / "curlew_paper"

    scenes = sorted((Scene.read(path) for path in (ROOT / "scenes").glob("*.txt")), key=lambda s: natural(s.name))
    tables = subprocess.run([paper_command, "list"], check=True, capture_output=True, text=True).stdout.split()
    work = [(scene.name, lambda scene=scene: run_scene(scene, command)) for scene in scenes]
    work += [(table, lambda table=table: run_table(table, paper_command, command)) for table in tables]
    if options.only:
        for name in set(options.only) - {name for name, run in work}:
            sys.exit(f"gallery: no scene or table '{name}'; choose one of "
                     + ", ".join([scene.name for scene in scenes] + tables))
        work = [(name, run) for name, run in work if name in options.only]

    gallery, paper = Page(DOCS / "gallery.md", GALLERY.format(width=WIDTH)), Page(DOCS / "paper_tables.md", TABLES)
    taken, pictures, failed = [], {}, []

    def write_pages():
        order = []
        for group in dict.fromkeys([GROUPS["shot"], OTHERS, *GROUPS.values()]):
            members = [scene.name for scene in scenes if scene.group() == group and scene.name in gallery.parts]
            order += [f"## {group}", *members] if members else []
        gallery.write(order)
        paper.write(tables)

    for name, run in work:
        print(f"gallery: {name}", file=sys.stderr)
        begin = time.monotonic()
        try:
            part, names = run()
        except RuntimeError as error:
            warn(f"{name} failed: {error}")
            failed.append(name)
            continue
        taken.append((time.monotonic() - begin, name))
        (paper if name in tables else gallery).parts[name] = part
        for picture in names:
            if picture in pictures:
                warn(f"{name} and {pictures[picture]} both write {picture}")
                failed.append(name)
            pictures[picture] = name
        write_pages()  # after each, so that an interrupted run keeps what it has made

    if not options.only and not failed:
        for picture in set(PICTURES.iterdir()) - {PICTURES / name for name in pictures}:
            picture.unlink()

    for seconds, name in taken:
        late = name not in tables and seconds > MOST_SECONDS
        print(f"{seconds:7.1f} s  {name}{f'  more than {MOST_SECONDS} s' if late else ''}")
    if failed:
        sys.exit(f"gallery: failed: {', '.join(failed)}")


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError, subprocess.CalledProcessError) as problem:
        sys.exit(f"gallery: {problem}")
