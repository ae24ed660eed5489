# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc doctor`: what is wrong with an installation or a bag, and the mend."""

from pathlib import Path

HELP = ('Check this installation or, where bags are named, those bags, and say in one sentence '
        'each what is wrong and how to mend it. The exit code is 1 where something will not work.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('bags', metavar='BAG', nargs='*', type=Path,
                        help='bag to check: a rosbag2 folder or an .mcap or .db3 file')


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.diagnosis.finding import ERROR, worst
    findings = []
    if args.bags:
        from hooc_perception.diagnosis.bag import check_bag
        for path in args.bags:
            print(path)
            findings += _show(check_bag(path))
    else:
        from hooc_perception.diagnosis.installation import check_installation
        findings = _show(check_installation())
    counts = {level: sum(f.level == level for f in findings) for level in ('error', 'warning')}
    print(f'{counts["error"]} errors, {counts["warning"]} warnings'
          + ('' if any(counts.values()) else ': all is well'))
    return int(worst(findings) == ERROR)


def _show(findings):
    """Print findings as they come, since some checks take seconds; return them as a list."""
    shown = []
    for finding in findings:
        shown.append(finding)
        print(f'  {finding.level:<8} {finding.subject:<22} {finding.text}', flush=True)
    return shown
