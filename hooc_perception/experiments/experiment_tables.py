# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables over all rows of a set, from the JSON files of `hooc evaluate --json`."""

from hooc_perception.evaluation import paper
from hooc_perception.evaluation.tables import Table
from hooc_perception.experiments import ablations
import numpy as np

HOOC = 'the paper, on HOOC'
TERMS = ('total', 'depth', 'probability', 'overlap')


def of_set(name, scores, records):
    """
    Return (summary tables, detailed tables) of one set.

    :param scores: {row: content of its scores file}, in the order of the tables.
    :param records: {step name: Record}, for the processor time.
    """
    posed = {row: s for row, s in scores.items() if 'mean' in s['results'][0]}
    masked = {row: s for row, s in scores.items() if 'masks' in s['results'][0]}
    seconds = {row: _seconds(name, row, s, records) for row, s in scores.items()}
    summary, details = [], []
    if posed:
        stages = {row: s for row, s in posed.items() if s['stages']}
        summary = [score_table(posed, seconds), *([stage_table(stages)] if stages else []),
                   category_table(posed, stages)]
        details = [visibility_table(posed), *full_visibility_tables(posed),
                   *scene_tables(posed), *energy_tables(posed)]
    if masked:
        summary.append(mask_table(masked, seconds))
        details.append(mask_scene_table(masked))
    return summary, [table for table in details if table]


def _seconds(name, row, scores, records):
    """Return the processor seconds of a scene in setting A; None where nobody measured."""
    record = records.get(f'{name}/{row}/A')
    first = scores['results'][0]
    n = len(first.get('scenes', ())) + len(first.get('masks', ()))
    return record.cpu_s / n if record and n else None


def _result(scores, setting):
    """Return the result of a setting in a scores file, None where there is none."""
    return next((r for r in scores['results'] if r['setting'] == setting), None)


def _three(value):
    return None if value is None else f'{value:.3f}'


def score_table(scores, seconds):
    """Return one row for every row and setting, the paper's own figures above them."""
    rows, bold = [], []
    for setting in 'AB':
        bold.append(len(rows))
        rows.append((HOOC, setting, *(_three(paper.mean(setting, c))
                                      for c in ('found', 'localized')), None, None,
                     f'{paper.mean(setting, "false_categories"):.1f}', *(None,) * 7))
        for row, content in scores.items():
            result = _result(content, setting)
            if result is None:
                continue
            mean, bop = result['mean'], result.get('bop') or {}
            placed = [o for s in result['scenes'] for o in s['objects'] if o['localized']]
            degrees = np.degrees([o['rotation_rad'] for o in placed])
            rows.append((
                f'`{row}`', setting, *(_three(mean[c]) for c in ('found', 'localized', 'tight')),
                _three(ablations.turned_right(result)),
                f'{mean["false_categories"]:.1f}',
                f'{1000 * np.median([o["centre_m"] for o in placed]):.0f}' if placed else None,
                f'{np.median(degrees):.0f}' if placed else None,
                *(bop.get(key) for key in ('vsd', 'mssd', 'mspd', 'average')),
                seconds[row] and f'{seconds[row]:.0f}' if setting == 'A' else None))
    return Table('Found and localized',
                 ('', 'setting', 'found', 'localized', '< 2 cm', '< 15 deg', 'false', 'mm', 'deg',
                  'AR VSD', 'AR MSSD', 'AR MSPD', 'AR', 'CPU s'), tuple(rows),
                 ('Means over scenes. Setting A: the full chain; B: the true poses are among the '
                  'candidates. < 15 deg: share of the true objects that are localized and turned '
                  'right, up to symmetry; false: categories a scene that are not there; mm, deg: '
                  "median errors of the localized; AR: BOP's average recalls; CPU s: processor "
                  'seconds a scene, start-up and compiled code from the cache included.',),
                 tuple(bold))


def stage_table(scores):
    """Return what each profile loses in which stage: means over scenes."""
    rows = []
    for row, content in scores.items():
        losses = list(content['stages'].values())

        def mean(part, key):
            values = [loss[part][key] for loss in losses if loss[part][key] is not None]
            return float(np.mean(values)) if values else None

        pool, local = mean('pool', 'pool_localized'), mean('answer', 'localized')
        rows.append((f'`{row}`', mean('pixels', 'accuracy'), mean('pixels', 'balanced_accuracy'),
                     mean('pixels', 'true_probability'), f'{mean("pool", "candidates"):.0f}',
                     pool, mean('pool', 'pool_tight'), mean('pool', 'first_localized'), local,
                     1 - pool, pool - local))
    return Table('What each stage loses',
                 ('', 'pixels right', 'by class', 'p(true)', 'candidates', 'in pool',
                  'in pool < 2 cm', 'ranked 1st', 'localized', 'lost before', 'lost in parsing'),
                 tuple(rows),
                 ('pixels right: share of the pixels on true objects whose most likely class is '
                  'right, by class: averaged over classes; in pool: share of the true objects '
                  "with a candidate of their category within half the model's size; ranked 1st: "
                  'whose best-scored candidate is one; lost before parsing: 1 - in pool; lost in '
                  'parsing: in pool - localized.',))


def _by_category(content):
    """Return {category: {pixels, correct, near}} summed over the scenes of a scores file."""
    out = {}
    for loss in content['stages'].values():
        for thing in loss['pool']['objects']:
            entry = out.setdefault(thing['category'], {'pixels': 0, 'correct': 0, 'near': 0})
            entry['near'] += thing['near']
        for category, count in loss['pixels']['categories'].items():
            entry = out.setdefault(category, {'pixels': 0, 'correct': 0, 'near': 0})
            entry['pixels'] += count['pixels']
            entry['correct'] += count['correct']
    return out


def category_table(scores, stages):
    """Return pixels right, objects in the pool and objects localized, by category and row."""
    losses = {row: _by_category(content) for row, content in stages.items()}
    counts = {row: _result(content, 'A')['categories'] for row, content in scores.items()}
    first, last = next(iter(counts.values())), counts.get('best') or [*counts.values()][-1]
    names = [name for name, count in first.items() if count['true']]
    names.sort(key=lambda name: (last[name]['localized'] / first[name]['true'], name))
    rows = []
    for name in names:
        cells = [name.replace('_', ' '), first[name]['true']]
        for row in losses:
            loss = losses[row].get(name, {'pixels': 0, 'correct': 0, 'near': 0})
            cells.append(loss['correct'] / loss['pixels'] if loss['pixels'] else None)
            cells.append(loss['near'])
        rows.append((*cells, *(counts[row][name]['localized'] for row in counts)))
    header = ('category', 'true', *(f'`{row}` {what}' for row in losses
                                    for what in ('pixels right', 'in pool')),
              *(f'`{row}` localized' for row in counts))
    return Table('By category', header, tuple(rows),
                 ('Hardest first. Objects in the pool and localized (setting A) are counts.',))


def visibility_table(scores):
    """Return Table 1 in short: pixel and surface visibility of every scene."""
    rows, every = [], []
    for name, things in next(iter(scores.values()))['visibility'].items():
        pixels = np.array([p for t in things for p in t['pixels'] if p is not None])
        total = np.array([t['total'] for t in things])
        every.append(total)
        inside = np.mean((total >= .39) & (total <= .71))
        rows.append((name, len(things), float(pixels.mean()), float(pixels.min()),
                     *map(float, (total.mean(), total.min(), total.max(), inside))))
    if not rows:
        return None
    total = np.concatenate(every)
    rows.append(('all', len(total), None, None, float(total.mean()), float(total.min()),
                 float(total.max()), float(np.mean((total >= .39) & (total <= .71)))))
    hooc = np.array(list(paper.VISIBILITY.values()))
    rows.append((f'{HOOC} 20(1)', len(hooc), float(hooc[:, :3].mean()),
                 float(hooc[:, :3].min()), *map(float, (hooc[:, 6].mean(), hooc[:, 6].min(),
                                                        hooc[:, 6].max(), 1.0))))
    return Table('Table 1: visibility', ('scene', 'objects', 'pixels, mean', 'least',
                                         'surface, mean', 'least', 'most', 'in .39-.71'),
                 tuple(rows),
                 ("pixels: share of an object's pixels that the others leave visible, over "
                  'objects and views; surface: share of its surface that some camera sees.',),
                 (len(rows) - 2, len(rows) - 1))


def full_visibility_tables(scores):
    """Return Table 1 object by object: of the last scene, which holds most, and the paper's."""
    visibility = next(iter(scores.values()))['visibility']
    if not visibility:
        return []
    name, things = list(visibility.items())[-1]

    def columns(what):
        return [f'{what} {j + 1}' for j in range(len(things[0]['pixels']))]

    return [Table(f'Table 1 in full: scene {name}',
                  ('object', *columns('pixels'), *columns('surface'), 'surface, any'),
                  tuple((t['category'].replace('_', ' '), *t['pixels'], *t['surface'], t['total'])
                        for t in things)),
            Table("Table 1: the paper's own, HOOC 20(1)",
                  ('object', *(f'{what} {j}' for what in ('pixels', 'surface')
                               for j in (1, 2, 3)), 'surface, any'),
                  tuple((thing.replace('_', ' '), *values)
                        for thing, values in paper.VISIBILITY.items()))]


def scene_tables(scores):
    """Return Tables 2 and 3: every scene, HOOC's nine scenes beside it where there are nine."""
    out = []
    columns = (('found', 'found'), ('localized', 'local'), ('false_categories', 'false'))
    for setting, title in (('A', 'Table 2: the full chain'),
                           ('B', 'Table 3: with the true poses among the candidates')):
        results = {row: r for row, s in scores.items() if (r := _result(s, setting))}
        if not results:
            continue
        names = [s['name'] for s in next(iter(results.values()))['scenes']]
        rows = [[name, *(r['scenes'][k][c] for r in results.values() for c, _ in columns)]
                for k, name in enumerate(names)]
        rows.append(['mean', *(r['mean'][c] for r in results.values() for c, _ in columns)])
        header = ['scene', *(f'`{row}` {short}' for row in results for _, short in columns)]
        if len(names) == len(paper.SCENES):
            header += ['HOOC', *(f'HOOC {short}' for _, short in columns)]
            for k, (row, name) in enumerate(zip(rows, (*paper.SCENES, 'mean'))):
                row += [name, *(paper.SCORES[setting][c][k] if k < len(names)
                                else paper.mean(setting, c) for c, _ in columns)]
        out.append(Table(title, tuple(header), tuple(map(tuple, rows)), (), (len(rows) - 1,)))
    return out


def energy_tables(scores):
    """Return Table 4: means of Eq. 1's terms for A, B and the truth; [] without energies."""
    rows = []
    for row, content in scores.items():
        sources = {f'`{row}` {s}': r['energy'] for s in 'AB'
                   if (r := _result(content, s)) and r['energy']}
        if sources:
            sources[f'`{row}` truth'] = content['truth_energy']
        for label, energies in sources.items():
            means = [[e[t] for e in energies.values() if e[t] is not None] for t in TERMS]
            if all(means):
                rows.append((label, *(f'{np.mean(values):.4f}' for values in means)))
    if not rows:
        return []
    rows += [(f'{HOOC} {label}', *(f'{v:.4f}' for v in np.mean(paper.ENERGY[label], axis=0)))
             for label in ('A', 'B', 'truth')]
    return [Table('Table 4: energy (Eq. 1), means over scenes', ('', *TERMS), tuple(rows),
                  ("Each profile's classifier gives other probabilities, so compare within a "
                   'profile. HOOC has other images and another share of background.',))]


def _sums(result):
    return [sum(m[k] for m in result['masks']) for k in ('explained', 'labelled', 'estimated')]


def mask_table(scores, seconds):
    """Return recall and precision of masks, one row each."""
    rows = []
    for row, content in scores.items():
        result = _result(content, 'A')
        explained, labelled, estimated = _sums(result)
        ious = [i for m in result['masks'] for i in m['iou']]
        rows.append((f'`{row}`', f'{explained}/{labelled}', _three(explained / labelled),
                     estimated, _three(explained / max(estimated, 1)), float(np.mean(ious)),
                     seconds[row] and f'{seconds[row]:.0f}'))
    return Table('Explained masks', ('', 'explained', 'recall', 'estimated', 'precision', 'IoU',
                                     'CPU s'), tuple(rows),
                 ('A labelled object is explained by a mask of IoU >= .5, one to one. CPU s: '
                  'processor seconds a scene.',))


def mask_scene_table(scores):
    """Return explained masks and the number of estimates of every scene."""
    results = {row: _result(content, 'A') for row, content in scores.items()}
    rows = [(m['name'], m['labelled'], *(r['masks'][k][c] for r in results.values()
                                         for c in ('explained', 'estimated')))
            for k, m in enumerate(next(iter(results.values()))['masks'])]
    return Table('Explained masks by scene', ('scene', 'labelled', *(
        f'`{row}` {c}' for row in results for c in ('explained', 'n'))), tuple(rows))


def step_table(records):
    """Return what every step took, the switches of a set as one, and the code that ran."""
    groups = {}
    for name, record in sorted(records.items()):
        head, row, *rest = name.split('/')
        if row == ablations.ROW:
            name = f'{head}/{row}'
        groups.setdefault(name, []).append(record)
    rows = [(name if len(rs) == 1 else f'{name} ({len(rs)})', f'{sum(r.cpu_s for r in rs):.0f}',
             f'{sum(r.wall_s for r in rs):.0f}', f'{max(r.peak_mb for r in rs):.0f}',
             ' '.join(dict.fromkeys(r.commit for r in rs if r.commit)) or None)
            for name, rs in groups.items()]
    total = sum(r.cpu_s for r in records.values())
    rows.append(('all', f'{total:.0f}', None, None, None))
    return Table('What it took', ('step', 'CPU s', 's', 'MB', 'code'), tuple(rows),
                 ('CPU s: processor seconds of the process and its workers; s: seconds passed, '
                  'on a machine that may have had other work; MB: most memory; code: the commit, '
                  '+ where files were changed since. (n): so many steps together.',),
                 (len(rows) - 1,))
