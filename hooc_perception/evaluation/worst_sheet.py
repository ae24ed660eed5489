# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One picture of the worst scenes: missed objects, wrong estimates, localized objects."""

from collections.abc import Iterable, Mapping, Sequence
import io
import json
from pathlib import Path
from typing import TypeAlias

from hooc_perception.core.arrays import BoolArray, Float64Array, Int32Array
from hooc_perception.core.render import render_depth, render_patch
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import shape_of
from hooc_perception.evaluation.report.pictures import depth_picture
from hooc_perception.evaluation.tables import to_markdown
from hooc_perception.evaluation.worst import worst_json, worst_table, WorstScene
import matplotlib
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
import numpy as np
from PIL import Image

MISSED, WRONG, RIGHT = '#ff5040', '#ff5cf4', '#58d68d'
COLUMNS = 3
MARGIN_PX = 14
# Left, top, right and bottom border, the latter two exclusive, pixels.
Window: TypeAlias = tuple[int, int, int, int]


def write_worst(folder: str | Path, label: str, scenes: Sequence[WorstScene],
                models: Mapping[str, GenericModel]) -> list[Path]:
    """
    Write worst.png, worst.json and worst.md into a folder; return their paths.

    :param scenes: at least one.
    :param models: {category: GenericModel}.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f'worst.{ending}' for ending in ('png', 'json', 'md')]
    content = worst_json(label, scenes)
    draw_sheet(scenes, models, paths[0])
    paths[1].write_text(json.dumps(content, indent=1, allow_nan=False) + '\n')
    paths[2].write_text(to_markdown(worst_table(content)))
    return paths


def draw_sheet(scenes: Sequence[WorstScene], models: Mapping[str, GenericModel],
               path: Path) -> None:
    """Draw one panel per scene and a legend into a PNG file."""
    rows = -(-(len(scenes) + 1) // COLUMNS)
    with matplotlib.rc_context({'font.size': 9}):
        figure = Figure(figsize=(4.2 * COLUMNS, 3.4 * rows), layout='constrained')
        axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for ax in axes:
            ax.set_axis_off()
        for ax, scene in zip(axes, scenes):
            _panel(ax, scene, models)
        axes[len(scenes)].legend(
            handles=[Line2D([], [], color=MISSED, label='missed: the true object'),
                     Line2D([], [], color=MISSED, ls=':', label='missed, hidden in this view'),
                     Line2D([], [], color=WRONG, label='wrong: an estimate'),
                     Line2D([], [], color=RIGHT, lw=0.8, label='localized: the true object')],
            loc='center left', frameon=False)
        stream = io.BytesIO()
        figure.savefig(stream, dpi=100)
    Image.open(stream).convert('RGB').quantize(
        palette=_palette(), dither=Image.Dither.NONE).save(path, 'PNG', optimize=True)


def _palette() -> Image.Image:
    """Return an image with the palette of the sheet: greys, and the outline colours on greys."""
    greys = np.repeat(np.linspace(0, 255, 112)[:, None], 3, 1)
    over = [greys[::10] * (1 - a) + 255 * np.array(to_rgb(colour)) * a
            for colour in (MISSED, WRONG, RIGHT) for a in (1, 0.75, 0.5, 0.25)]
    image = Image.new('P', (1, 1))
    image.putpalette(np.concatenate([greys, *over]).round().astype(np.uint8).tobytes())
    return image


def _panel(ax: Axes, scene: WorstScene, models: Mapping[str, GenericModel]) -> None:
    """Draw one scene in the view that shows most of the missed objects."""
    camera, depth = scene.view.camera, scene.view.depth
    true = [world_mesh(t, models[t.category]) for t in scene.truths]
    shown = render_depth(true, camera)[1]
    estimated = [world_mesh(e, shape_of(e, models)) for e in scene.estimates]
    answer = render_depth(estimated, camera)[1]
    missed = {m.truth for m in scene.missed}
    box = [_window((shown >= 0) | np.isin(answer, scene.wrong))]
    for i in range(len(true)):
        if i not in missed:
            _outline(ax, shown == i, RIGHT, 0.8)
    for i in scene.wrong:
        _labelled(ax, answer == i, WRONG, f'{scene.estimates[i].category}?', 'below')
    for i in sorted(missed):
        mask, style = shown == i, '-'
        if not mask.any():
            mask, style = _alone(true[i], camera), ':'
            box.append(_window(mask))
        _labelled(ax, mask, MISSED, scene.truths[i].category, 'above', style)
    u0, v0, u1, v1 = _limits(box, camera)
    near = depth[v0:v1, u0:u1][shown[v0:v1, u0:u1] >= 0]
    near = near[np.isfinite(near)]
    low, high = np.percentile(near, (1, 99)) if len(near) else (0.5, 2.0)
    grey = depth_picture(depth, camera, low - 0.05, high + 0.1).mean(-1)
    ax.imshow(grey, cmap='gray', vmin=0, vmax=255, interpolation='nearest')
    ax.set_xlim(u0 - 0.5, u1 - 0.5)
    ax.set_ylim(v1 - 0.5, v0 - 0.5)
    ax.set_title(f'{scene.name}: {len(true) - len(missed)} of {len(true)} localized, '
                 f'{len(scene.wrong)} wrong ({camera.name})', fontsize=9)


def _alone(mesh: tuple[Float64Array, Int32Array], camera: Camera) -> BoolArray:
    """Return (H, W) bool: where a mesh would be visible if nothing occluded it."""
    mask = np.zeros(camera.height * camera.width, bool)
    mask[render_patch(mesh[0], mesh[1], camera)[0]] = True
    return mask.reshape(camera.height, camera.width)


def _window(mask: BoolArray) -> Window | None:
    """Return (u0, v0, u1, v1) around a mask, None where it is empty."""
    v, u = np.nonzero(mask)
    return (u.min(), v.min(), u.max() + 1, v.max() + 1) if len(u) else None


def _limits(windows: Iterable[Window | None], camera: Camera) -> Window:
    """Return (u0, v0, u1, v1) around all windows with a margin, within the image."""
    known = np.array([w for w in windows if w] or [(0, 0, camera.width, camera.height)])
    low = np.maximum(known[:, :2].min(0) - MARGIN_PX, 0)
    high = np.minimum(known[:, 2:].max(0) + MARGIN_PX, (camera.width, camera.height))
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _outline(ax: Axes, mask: BoolArray, colour: str, width: float, style: str = '-') -> None:
    """Draw the outline of a mask, if it is not empty."""
    if mask.any():
        # Padded, so that the outline closes at the border of the image.
        ax.contour(np.arange(-1, mask.shape[1] + 1), np.arange(-1, mask.shape[0] + 1),
                   np.pad(mask, 1).astype(float), [0.5], colors=[colour], linewidths=[width],
                   linestyles=[style])


def _labelled(ax: Axes, mask: BoolArray, colour: str, category: str, side: str,
              style: str = '-') -> None:
    """Draw an outline with its name above or below, so that two at one place are both legible."""
    window = _window(mask)
    if window is None:
        return
    _outline(ax, mask, colour, 1.5, style)
    u0, v0, u1, v1 = window
    at = (v0 - 1, 'bottom') if side == 'above' else (v1, 'top')
    ax.text((u0 + u1 - 1) / 2, at[0], category.replace('_', ' '), color=colour, fontsize=8,
            fontweight='bold', ha='center', va=at[1], in_layout=False,
            path_effects=[withStroke(linewidth=1.6, foreground='black')])
