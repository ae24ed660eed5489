# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc doctor`: what is wrong with an installation or a bag, and the mend."""

from pathlib import Path

from hooc_perception.errors import HoocError

HELP = ('Check this installation or, where bags are named, those bags, and say in one sentence '
        'each what is wrong and how to mend it. The exit code is 1 where something will not work.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('bags', metavar='BAG', nargs='*', type=Path,
                        help='bag to check: a rosbag2 folder or an .mcap or .db3 file')
    parser.add_argument('--model', type=Path, metavar='MODEL',
                        help='also say whether this model fits the cameras of the bags')
    parser.add_argument('--salvage', type=Path, metavar='NEW_BAG',
                        help='write what can be read of one damaged bag to a new one, check that')


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.diagnosis.finding import ERROR, worst
    findings = []
    if args.salvage and len(args.bags) != 1:
        raise HoocError('--salvage takes one bag; name it')
    if args.model and not args.bags:
        raise HoocError('--model is held against bags; name one')
    if args.salvage:
        args.bags = [_salvage(args.bags[0], args.salvage)]
    if args.bags:
        from hooc_perception.diagnosis.bag import check_bag, check_rig
        from hooc_perception.trained.folder import load_model_folder
        model = load_model_folder(args.model) if args.model else None
        for path in args.bags:
            print(path)
            findings += _show(check_bag(path))
            if model:
                findings += _show(check_rig(path, model))
    else:
        from hooc_perception.diagnosis.installation import check_installation
        findings = _show(check_installation())
    counts = {level: sum(f.level == level for f in findings) for level in ('error', 'warning')}
    print(f'{counts["error"]} errors, {counts["warning"]} warnings'
          + ('' if any(counts.values()) else ': all is well'))
    return int(worst(findings) == ERROR)


def _salvage(path, out):
    """Write what can be read of a bag to a new one; return the latter."""
    from hooc_perception.io.bags.salvage import salvaged, write_salvaged
    found = salvaged(path)
    for note in dict.fromkeys(found.notes):
        print(f'  {note}')
    if not found.messages:
        raise HoocError(f'{path}: no message can be read any more; record again')
    write_salvaged(found, out)
    print(f'{out}: {len(found.messages)} messages saved')
    return out


def _show(findings):
    """Print findings as they come, since some checks take seconds; return them as a list."""
    shown = []
    for finding in findings:
        shown.append(finding)
        print(f'  {finding.level:<8} {finding.subject:<22} {finding.text}', flush=True)
    return shown
