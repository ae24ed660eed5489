# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Draw a picture of the whole catalogue, with names.

Usage: python -m hooc_perception.objects.contact_sheet OUT.png
"""

from collections.abc import Mapping
import sys

from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.shaded import Orbit, render_shaded
import numpy as np
from PIL import Image, ImageDraw, ImageFont
import trimesh

COLUMNS = 5
CELL = (232, 196)
LABEL = 24
INK = (40, 44, 52)


def contact_sheet(meshes: Mapping[str, trimesh.Trimesh], columns: int = COLUMNS,
                  cell: tuple[int, int] = CELL) -> Image.Image:
    """
    Return a picture of named meshes in a grid, each with the length of its longest side.

    :param meshes: name -> mesh in metres.
    :param cell: (width, height) of one picture, pixels.
    """
    rows = -(-len(meshes) // columns)
    width, height = cell
    sheet = Image.new('RGB', (columns * width, rows * (height + LABEL)), (255, 255, 255))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for i, (name, mesh) in enumerate(meshes.items()):
        x, y = i % columns * width, i // columns * (height + LABEL)
        hue = np.array(Image.new('HSV', (1, 1), (i * 256 // max(len(meshes), 1), 110, 215))
                       .convert('RGB'))[0, 0]
        picture = render_shaded([mesh], Orbit(), (width, height), [tuple(hue)])
        sheet.paste(Image.fromarray(picture), (x, y))
        text = f'{name}  {100 * mesh.extents.max():.0f} cm'
        draw.text((x + width / 2, y + height + LABEL / 2), text, INK, font, anchor='mm')
    return sheet


def main() -> int:
    """Write the contact sheet to the given path; return the exit status."""
    if len(sys.argv) != 2 or sys.argv[1].startswith('-'):
        print(__doc__)
        return 0 if '--help' in sys.argv or '-h' in sys.argv else 2
    sheet = contact_sheet({name: build() for name, build in CATALOGUE.items()})
    sheet.save(sys.argv[1], optimize=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
