# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What `make results` runs: a list of `hooc` commands with what they read and write.

A *row* is what a table has a row for: a profile or a baseline. Every row of every set is its
own chain of steps, so that one can be computed again without the others. The row `ablations` is
a table of its own: the profile `best`, with its model, less one part at a time.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hooc_perception.chain import PROFILES
from hooc_perception.errors import HoocError
from hooc_perception.experiments.ablations import NO_VERIFIER, Switch, SWITCHES, UNVERIFIED
from hooc_perception.experiments.ablations import ROW as ABLATIONS
from hooc_perception.io.scenes.scene_set import load_scene_set

BASELINES = ('fpfh', 'ppf')
SCORED = PROFILES + BASELINES
ROWS = SCORED + (ABLATIONS,)
INCREMENTAL = 'incremental'
# Profiles that have a verifier.
VERIFIED = ('best', 'fast')
# Of a set that is not listed here, all of ROWS are made where none are asked for.
ROWS_OF = {'shapes': ('best', 'fast'), 'hots': ('best', 'fast'), 'glassware': ('best', 'fast'),
           'moves': ('best', INCREMENTAL)}
# Further options of `hooc train` for a set. Things of no category stand on the tables of hots.
TRAIN_OF = {'hots': ('--strangers',)}

# Modules whose code, with all that they import, a kind of step runs.
_SETS = 'hooc_perception.io.scenes.scene_set'
_SCORES = ('hooc_perception.evaluation.as_json', 'hooc_perception.evaluation.evaluate', _SETS)
CODE = {
    'twin': ('hooc_perception.synthesis.twin',),
    'train': ('hooc_perception.training.train', _SETS),
    'parse': ('hooc_perception.parser', 'hooc_perception.core.profiles',
              'hooc_perception.evaluation.true_poses', 'hooc_perception.trained.folder',
              'hooc_perception.io.scenes.results', _SETS),
    'baseline': ('hooc_perception.evaluation.baselines', _SETS),
    'scores': _SCORES,
    'scores with energy': ('hooc_perception.evaluation.rerun', *_SCORES),
    'stages': ('hooc_perception.evaluation.as_json', 'hooc_perception.evaluation.rerun', _SETS),
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
    arguments: tuple[str | Path, ...]
    inputs: tuple[Path, ...]
    output: Path


@dataclass(frozen=True)
class Layout:
    """Where the files of one set lie under the folder of all results."""

    root: Path
    name: str

    def model(self, row: str) -> Path:
        """Return the model folder of a profile."""
        return self.root / self.name / 'models' / row

    def results(self, row: str, setting: str) -> Path:
        """Return the results file of a row in setting 'A', 'B' or UNVERIFIED."""
        return self.root / self.name / setting / f'{row}.json'

    def scores(self, row: str) -> Path:
        """Return the scores of a row, as `hooc evaluate --json` writes them."""
        return self.root / self.name / 'scores' / f'{row}.json'

    def stages(self, row: str) -> Path:
        """Return what the stages of a profile lose, as `hooc stages --json` writes it."""
        return self.root / self.name / 'stages' / f'{row}.json'

    @property
    def plots(self) -> Path:
        """Return the folder of pictures."""
        return self.root / self.name / 'plots'

    @property
    def worst(self) -> Path:
        """Return the folder of the picture and the list of the worst scenes of `best`."""
        return self.root / self.name / 'worst'

    @property
    def twin(self) -> Path:
        """Return the folder of the set itself, where it is ours to write."""
        return self.root / self.name / 'set'


@dataclass(frozen=True)
class _SetPlan:
    """
    What the steps of one set have in common.

    :ivar path: folder of the set; `posed` says whether some of its scenes have true poses,
        `moving` whether it has sequences.
    """

    layout: Layout
    path: Path
    posed: bool
    moving: bool
    seed: str
    jobs: str

    def row(self, row: str) -> list[Step]:
        """Return the steps of one row."""
        if row == ABLATIONS:
            return self._ablations()
        if row == INCREMENTAL:
            return self._incremental()
        return self._baseline(row) if row in BASELINES else self._profile(row)

    def _step(self, row: str, what: str, kind: str, arguments: Iterable[str | Path],
              inputs: Iterable[Path], output: Path) -> Step:
        """Return a Step whose command ends with the place of its output."""
        option = '--json' if kind.startswith(('scores', 'stages')) else '--out'
        return Step(f'{self.layout.name}/{row}/{what}', row.partition('/')[0], kind,
                    (*arguments, option, output), (self.path, *inputs), output)

    def _scores(self, row: str, answers: Sequence[Path], model: Path | None = None) -> Step:
        """Return the step that scores the answers of a row."""
        more: list[str | Path] = (
            ['--bop'] if self.posed and not self.moving and '/' not in row else [])
        if model:
            more += ['--model', model]
        return self._step(row, 'scores', 'scores with energy' if model else 'scores',
                          ['evaluate', self.path, *answers, *more],
                          [*answers, *([model] if model else [])], self.layout.scores(row))

    def _baseline(self, row: str) -> list[Step]:
        """Return the steps of a baseline."""
        answer = self.layout.results(row, 'A')
        return [self._step(row, 'A', 'baseline', ['baseline', self.path, '--method', row,
                                                  '--seed', self.seed], [], answer),
                self._scores(row, [answer])]

    def _profile(self, row: str) -> list[Step]:
        """Return the steps of a profile: training, every setting, scores, stages."""
        path, model, answers = self.path, self.layout.model(row), [self.layout.results(row, 'A')]
        out = [self._step(row, 'train', 'train',
                          ['train', path, '--profile', row, '--seed', self.seed, '--jobs',
                           self.jobs, *TRAIN_OF.get(self.layout.name, ())], [], model)]
        parse = self._parse(row)
        out.append(self._step(row, 'A', 'parse', parse, [model], answers[0]))
        if self.moving or not self.posed:
            return [*out, self._scores(row, answers)]
        for setting, more in _true_pose_settings(row).items():
            answers.append(self.layout.results(row, setting))
            out.append(self._step(row, setting, 'parse', [*parse, '--true-poses', *more], [model],
                                  answers[-1]))
        return [*out, self._scores(row, answers, model),
                self._step(row, 'stages', 'stages', ['stages', path, '--model', model], [model],
                           self.layout.stages(row))]

    def _parse(self, profile: str) -> list[str | Path]:
        """Return the command that parses the set with a profile and its model."""
        return ['parse', self.path, '--model', self.layout.model(profile), '--profile', profile,
                '--seed', self.seed]

    def _incremental(self) -> list[Step]:
        """Return the steps of the row `incremental`."""
        answer = self.layout.results(INCREMENTAL, 'A')
        return [self._step(INCREMENTAL, 'A', 'parse', [*self._parse('best'), '--incremental'],
                           [self.layout.model('best')], answer),
                self._scores(INCREMENTAL, [answer])]

    def _ablations(self) -> list[Step]:
        """Return the steps of the row `ablations`: two for every switch."""
        out, model = [], self.layout.model('best')
        for switch in SWITCHES:
            answer = self.layout.results(switch.row, 'A')
            out += [self._step(switch.row, 'A', 'parse', [*self._parse('best'), *_changed(switch)],
                               [model], answer),
                    self._scores(switch.row, [answer])]
        return out

    def pictures(self, wanted: Sequence[str]) -> list[Step]:
        """Return the steps that draw the scores and the worst scenes of `best`."""
        layout, path = self.layout, self.path
        files = tuple(layout.results(row, 'A') for row in SCORED
                      if row in wanted or layout.results(row, 'A').exists())
        out = [Step(f'{layout.name}/plots', 'plots', 'plots',
                    ('evaluate', path, *files, '--plots', layout.plots),
                    (path, *files), layout.plots)]
        files = (layout.results('best', 'A'), layout.stages('best'))
        if 'best' in wanted or all(file.exists() for file in files):
            out.append(Step(f'{layout.name}/worst', 'plots', 'worst',
                            ('worst', path, files[0], '--count', str(WORST), '--stages', files[1],
                             '--out', layout.worst), (path, *files), layout.worst))
        return out


def _changed(switch: Switch) -> list[str]:
    """Return the options of `hooc parse` that switch a part off."""
    return [text for p in switch.parameters for text in ('--set-parameter', p)]


def _true_pose_settings(row: str) -> dict[str, list[str]]:
    """Return {setting: more options} of a profile's answers with the true poses in the pool."""
    return {'B': []} | ({UNVERIFIED: _changed(NO_VERIFIER)} if row in VERIFIED else {})


def steps_of(sets: Mapping[str, str | Path | None], root: str | Path,
             rows: Sequence[str] | None = None, seed: int = 0, jobs: int = 0) -> list[Step]:
    """
    Return the [Step] of all experiments, in an order in which they can run.

    :param sets: {name: folder, or None for the twin, which is then written first}.
    :param root: folder of everything that is computed.
    :param rows: None = those of ROWS_OF, and all of ROWS for a set that it does not name. Sets
        that have none of them are passed over.
    :raises HoocError: where a row or a set does not exist.
    """
    for row in rows or ():
        if row not in (*ROWS, INCREMENTAL):
            raise HoocError(f'there is no row {row!r}; choose among {", ".join(ROWS)}, '
                            f'{INCREMENTAL}')
    out = []
    for name, folder in sets.items():
        layout, steps = Layout(Path(root), name), []
        if folder is None:
            if name != 'twin':
                raise HoocError(f'the set {name} needs a folder: {name}=FOLDER; only the twin '
                                'is written here')
            path, posed, moving = layout.twin, True, False
            steps.append(Step(f'{name}/set', 'set', 'twin',
                              ('twin', '--out', path, '--seed', str(seed)), (), path))
        else:
            path, scene_set = Path(folder), load_scene_set(folder)
            posed = any(scene.truth for scene in scene_set.scenes)
            moving = bool(scene_set.sequences)
        plan = _SetPlan(layout, path, posed, moving, str(seed), str(jobs))
        asked = ROWS_OF.get(name, ROWS) if rows is None else rows
        wanted = _with_best(layout, [row for row in asked if moving or row != INCREMENTAL])
        for row in wanted:
            steps += plan.row(row)
        if posed and not moving:
            steps += plan.pictures(wanted)
        out += steps if wanted else ()
    return out


def _with_best(layout: Layout, rows: Sequence[str]) -> list[str]:
    """Return the rows in the order of ROWS, with `best` where rows that need it lack it."""
    there = layout.model('best').exists() and layout.scores('best').exists()
    needs_best = not there and not {ABLATIONS, INCREMENTAL}.isdisjoint(rows)
    return [row for row in (*ROWS, INCREMENTAL)
            if row in rows or needs_best and row == 'best']
