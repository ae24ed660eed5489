# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc doctor`: diagnoses an installation, a bag or a scene set and suggests fixes."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.diagnosis.finding import Finding

HELP = ('Diagnose this installation, or the given bags and scene sets. Every finding is one '
        'sentence that says what is wrong and how to fix it. The exit code is 1 if something will '
        'not work.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('bags', metavar='BAG|SET', nargs='*', type=Path,
                        help='what to check: a bag (a rosbag2 folder, or an .mcap, .db3 or .bag '
                        'file), a scene set or a BOP dataset')
    parser.add_argument('--model', type=Path, metavar='MODEL',
                        help='also check whether this model fits the cameras of the bags or sets')
    parser.add_argument('--salvage', type=Path, metavar='NEW_BAG',
                        help='recover the readable part of one damaged bag into a new bag and '
                        'check that')


def run(args: Namespace) -> int:
    """Run the command; return the exit code."""
    from hooc_perception.diagnosis.finding import ERROR, worst
    findings: list[Finding] = []
    if args.salvage and len(args.bags) != 1:
        raise HoocError('--salvage recovers exactly one bag; name one')
    if args.model and not args.bags:
        raise HoocError('--model is checked against bags and sets; name at least one')
    if args.salvage:
        args.bags = [_salvage(args.bags[0], args.salvage)]
    if args.bags:
        from hooc_perception.diagnosis.bag import check_bag
        from hooc_perception.diagnosis.geometry import check_rig
        from hooc_perception.diagnosis.scene_set import check_set, check_set_rig, is_set
        from hooc_perception.trained.folder import load_model_folder
        model = load_model_folder(args.model) if args.model else None
        for path in args.bags:
            print(path)
            check, check_fit = (check_set, check_set_rig) if is_set(path) else (
                check_bag, check_rig)
            findings += _show(check(path))
            if model:
                findings += _show(check_fit(path, model))
    else:
        from hooc_perception.diagnosis.installation import check_installation
        findings = _show(check_installation())
    counts = {level: sum(f.level == level for f in findings) for level in ('error', 'warning')}
    print(f'{counts["error"]} errors, {counts["warning"]} warnings'
          + ('' if any(counts.values()) else ': everything is fine'))
    return int(worst(findings) == ERROR)


def _salvage(path: Path, out: Path) -> Path:
    """Write the readable part of a bag to a new one; return the path of that."""
    from hooc_perception.io.bags.salvage import salvage_bag, write_salvaged
    found = salvage_bag(path)
    for note in dict.fromkeys(found.notes):
        print(f'  {note}')
    if not found.messages:
        raise HoocError(f'{path}: no message can be read; record it again')
    write_salvaged(found, out)
    print(f'{out}: {len(found.messages)} messages recovered')
    return out


def _show(findings: 'Iterable[Finding]') -> 'list[Finding]':
    """Print findings as they come, since some checks take seconds; return them as a list."""
    shown = []
    for finding in findings:
        shown.append(finding)
        print(f'  {finding.level:<8} {finding.subject:<22} {finding.text}', flush=True)
    return shown
