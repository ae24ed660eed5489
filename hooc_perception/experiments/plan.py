# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What `make results` runs: a list of `hooc` commands with what they read and write.

A *row* is what a table has a row for: a profile or a baseline. Every row of every set is its
own chain of steps, so that one can be computed again without the others. The row `ablations` is
a table of its own: the profile `best`, with its model, less one part at a time.
"""

from dataclasses import dataclass
from pathlib import Path

from hooc_perception.chain import PROFILES
from hooc_perception.errors import HoocError
from hooc_perception.experiments.ablations import ROW as ABLATIONS
from hooc_perception.experiments.ablations import SWITCHES
from hooc_perception.io.scenes.scene_set import load_scene_set

BASELINES = ('fpfh', 'ppf')
SCORED = PROFILES + BASELINES
ROWS = SCORED + (ABLATIONS,)

# Modules whose code, with all that they import, a kind of step runs.
_SETS = 'hooc_perception.io.scenes.scene_set'
CODE = {
    'twin': ('hooc_perception.synthesis.twin',),
    'train': ('hooc_perception.training.train', _SETS),
    'parse': ('hooc_perception.core.pipeline', 'hooc_perception.core.profiles',
              'hooc_perception.evaluation.true_poses', 'hooc_perception.trained.folder',
              'hooc_perception.io.scenes.results', _SETS),
    'baseline': ('hooc_perception.evaluation.baselines', _SETS),
    'scores': ('hooc_perception.evaluation.as_json', 'hooc_perception.evaluation.evaluate',
               _SETS),
    'stages': ('hooc_perception.evaluation.as_json', 'hooc_perception.evaluation.evaluate',
               'hooc_perception.evaluation.rerun', _SETS),
    'plots': ('hooc_perception.evaluation.evaluate', 'hooc_perception.evaluation.plots', _SETS),
    'worst': ('hooc_perception.evaluation.evaluate', 'hooc_perception.evaluation.worst_sheet',
              _SETS),
}
# So many scenes of `best` are drawn.
WORST = 5


@dataclass(frozen=True)
class Step:
    """
    One `hooc` command.

    :ivar name: set/row/what, unique.
    :ivar row: the row that it belongs to; 'set' and 'plots' belong to none.
    :ivar kind: key of CODE.
    :ivar arguments: of `hooc`; paths are Path objects.
    :ivar inputs: files and folders that it reads; `output` the one that it writes.
    """

    name: str
    row: str
    kind: str
    arguments: tuple
    inputs: tuple
    output: Path


@dataclass(frozen=True)
class Layout:
    """Where the files of one set lie under the folder of all results."""

    root: Path
    name: str

    def model(self, row):
        """Return the model folder of a profile."""
        return self.root / self.name / 'models' / row

    def results(self, row, setting):
        """Return the results file of a row in setting 'A' or 'B'."""
        return self.root / self.name / setting / f'{row}.json'

    def scores(self, row):
        """Return the scores of a row, as `hooc evaluate --json` writes them."""
        return self.root / self.name / 'scores' / f'{row}.json'

    @property
    def plots(self):
        """Return the folder of pictures."""
        return self.root / self.name / 'plots'

    @property
    def worst(self):
        """Return the folder of the picture and the list of the worst scenes of `best`."""
        return self.root / self.name / 'worst'

    @property
    def twin(self):
        """Return the folder of the set itself, where it is ours to write."""
        return self.root / self.name / 'set'


def steps_of(sets, root, rows=ROWS, seed=0, jobs=0):
    """
    Return the [Step] of all experiments, in an order in which they can run.

    :param sets: {name: folder, or None for the twin, which is then written first}.
    :param root: folder of everything that is computed.
    :raises HoocError: a row or a set that there is not.
    """
    for row in rows:
        if row not in ROWS:
            raise HoocError(f'there is no row {row!r}; choose among {", ".join(ROWS)}')
    out = []
    for name, path in sets.items():
        layout = Layout(Path(root), name)
        if path is None:
            if name != 'twin':
                raise HoocError(f'the set {name} needs a folder: {name}=FOLDER; only the twin '
                                'is written here')
            path = layout.twin
            out.append(Step(f'{name}/set', 'set', 'twin',
                            ('twin', '--out', path, '--seed', str(seed)), (), path))
            posed = True
        else:
            path = Path(path)
            posed = any(scene.truth for scene in load_scene_set(path).scenes)
        wanted = _with_best(layout, rows)
        for row in wanted:
            out += (_ablations(layout, path, str(seed)) if row == ABLATIONS
                    else _row(layout, path, row, posed, str(seed), str(jobs)))
        if posed:
            files = tuple(layout.results(row, 'A') for row in SCORED
                          if row in wanted or layout.results(row, 'A').exists())
            out.append(Step(f'{name}/plots', 'plots', 'plots',
                            ('evaluate', path, *files, '--plots', layout.plots),
                            (path, *files), layout.plots))
            files = (layout.results('best', 'A'), layout.scores('best'))
            if 'best' in wanted or all(file.exists() for file in files):
                out.append(Step(f'{name}/worst', 'plots', 'worst',
                                ('evaluate', path, files[0], '--worst', str(WORST),
                                 '--stages-from', files[1], '--plots', layout.worst),
                                (path, *files), layout.worst))
    return out


def _row(layout, path, row, posed, seed, jobs):
    """Return the steps of one row of a set."""
    def step(what, kind, arguments, inputs, output):
        return Step(f'{layout.name}/{row}/{what}', row, kind, tuple(arguments), tuple(inputs),
                    output)

    score = ['--json', layout.scores(row), *(['--bop'] if posed else [])]
    answer = layout.results(row, 'A')
    if row in BASELINES:
        return [step('A', 'baseline', ['evaluate', path, '--baseline', row, '--out', answer,
                                       '--seed', seed], [path], answer),
                step('scores', 'scores', ['evaluate', path, answer, *score], [path, answer],
                     layout.scores(row))]
    model, answers = layout.model(row), [answer]
    out = [step('train', 'train', ['train', path, '--out', model, '--profile', row, '--seed',
                                   seed, '--jobs', jobs], [path], model)]
    parse = ['parse', path, '--model', model, '--profile', row, '--seed', seed]
    out.append(step('A', 'parse', [*parse, '--out', answer], [path, model], answer))
    if posed:
        answers.append(layout.results(row, 'B'))
        out.append(step('B', 'parse', [*parse, '--true-poses', '--out', answers[1]],
                        [path, model], answers[1]))
        score += ['--model', model, '--stages']
    out.append(step('scores', 'stages' if posed else 'scores',
                    ['evaluate', path, *answers, *score],
                    [path, *answers, *([model] if posed else [])], layout.scores(row)))
    return out


def _with_best(layout, rows):
    """Return the rows in the order of ROWS, with `best` where its ablations lack it."""
    needed = () if layout.model('best').exists() and layout.scores('best').exists() else ('best',)
    return [row for row in ROWS if row in rows or ABLATIONS in rows and row in needed]


def _ablations(layout, path, seed):
    """Return the steps of the row `ablations` of a set: two for every switch."""
    out, model = [], layout.model('best')
    for switch in SWITCHES:
        answer, scores = layout.results(switch.row, 'A'), layout.scores(switch.row)
        changed = [text for p in switch.parameters for text in ('--set-parameter', p)]
        name = f'{layout.name}/{switch.row}'
        out.append(Step(f'{name}/A', ABLATIONS, 'parse',
                        ('parse', path, '--model', model, '--profile', 'best', '--seed', seed,
                         *changed, '--out', answer), (path, model), answer))
        out.append(Step(f'{name}/scores', ABLATIONS, 'scores',
                        ('evaluate', path, answer, '--json', scores), (path, answer), scores))
    return out
