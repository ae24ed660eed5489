# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The rows of the report's tables: estimates, missed objects, candidates, events."""

from typing import Any

from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import Palette
from hooc_perception.evaluation.report.scene import EVIDENCE, ReportScene, UNKNOWN
import numpy as np

MAX_REJECTED = 80


def object_rows(scene: ReportScene, palette: Palette) -> list[dict[str, Any]]:
    """Return one row per estimate."""
    scores = scene.scores
    by_estimate = {s.estimate: s for s in scores or () if s.estimate is not None}
    true = {t.category for t in scene.truth or ()}
    drawn = [i for i, o in enumerate(scene.objects) if o.category in scene.models]
    colours, rows = pictures.instance_colours(scene.objects, palette), []
    for i, thing in enumerate(scene.objects):
        score = by_estimate.get(i)
        evidence = scene.evidence[i] if i < len(scene.evidence) else {}
        verdict = None
        if thing.category == UNKNOWN:
            verdict = 'unknown'
        elif scores is not None:
            verdict = ('ok' if score.localized else 'far') if score else (
                'extra' if thing.category in true else 'false')
        rows.append({
            'k': drawn.index(i) if i in drawn else -1, 'name': thing.category, 'id': thing.id,
            'score': thing.score, 'at': [100 * x for x in thing.translation],
            'size': [100 * x for x in thing.size], 'verdict': verdict,
            'error_mm': 1000 * score.centre_m if score else None,
            'turn': float(np.degrees(score.rotation_rad)) if score else None,
            'colour': pictures.hex_colour(colours[i]),
            **{key: evidence.get(key) for key in EVIDENCE}})
    return rows


def missed_rows(scene: ReportScene, palette: Palette) -> list[dict[str, Any]]:
    """Return one row per true object without an estimate."""
    truth = scene.truth or ()
    return [{'name': s.category, 'at': [100 * x for x in truth[s.truth].translation],
             'size': [100 * x for x in truth[s.truth].size],
             'colour': pictures.hex_colour(palette[s.category])}
            for s in scene.scores or () if s.estimate is None]


def event_rows(scene: ReportScene, palette: Palette) -> list[dict[str, Any]] | None:
    """Return one row per event before a frame set, None where nobody says."""
    if scene.events is None:
        return None
    rows = []
    for event in scene.events:
        now, before = event.get('translation'), event.get('before')
        gap = None if now is None or before is None else np.subtract(now, before)
        rows.append({
            'what': event['event'], 'name': event['category'], 'id': event['id'],
            'moved_cm': None if gap is None else 100 * float(np.linalg.norm(gap)),
            'colour': pictures.hex_colour(palette[event['category']])})
    return rows


def rejected_rows(scene: ReportScene, palette: Palette) -> list[dict[str, Any]]:
    """Return the best rejected candidates, at most two per category."""
    out: list[dict[str, Any]] = []
    count: dict[str, int] = {}
    for c in scene.rejected:
        count[c.category] = count.get(c.category, 0) + 1
        if count[c.category] > 2 or len(out) >= MAX_REJECTED:
            continue
        gaps = [float(np.linalg.norm(np.subtract(t.translation, c.translation)))
                for t in scene.truth or () if t.category == c.category]
        out.append({'name': c.category, 'score': c.score, 'at': [100 * x for x in c.translation],
                    'gap_mm': 1000 * min(gaps) if gaps else None,
                    'colour': pictures.hex_colour(palette[c.category])})
    return out
