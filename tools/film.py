#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes an animated GIF of pictures: film.py FILM.gif FRAMES_PER_SECOND [--small] PICTURE ...

The frames share one palette, so that colours do not flicker. --small: 64 colours without dithering, for a third less data.
"""

import sys
from pathlib import Path

from PIL import Image

COLOURS, FEW = 256, 64
SAMPLES = 6  # pictures that the palette is made of


def palette_of(pictures, colours):
    """Returns a picture with a palette for all pictures, made of some of them side by side."""
    chosen = pictures[:: max(1, len(pictures) // SAMPLES)]
    width, height = chosen[0].size
    sheet = Image.new("RGB", (width * len(chosen), height))
    for k, picture in enumerate(chosen):
        sheet.paste(picture, (k * width, 0))
    return sheet.quantize(colours, dither=Image.Dither.NONE)


def main(film, rate, names):
    """Writes the film."""
    small = "--small" in names
    names = [name for name in names if name != "--small"]
    pictures = [Image.open(name).convert("RGB") for name in names]
    if len({picture.size for picture in pictures}) != 1:
        raise ValueError("the pictures differ in size")
    palette = palette_of(pictures, FEW if small else COLOURS)
    dither = Image.Dither.NONE if small else Image.Dither.FLOYDSTEINBERG
    first, *others = [picture.quantize(palette=palette, dither=dither) for picture in pictures]
    first.save(film, save_all=True, append_images=others, duration=round(1000 / rate), loop=0)
    print(f"{film}: {len(pictures)} frames, {Path(film).stat().st_size >> 10} KiB")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    try:
        main(sys.argv[1], float(sys.argv[2]), sys.argv[3:])
    except (OSError, ValueError) as error:
        sys.exit(f"film.py: {error}")
