# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`make results`: recompute what is out of date, then write the tables into the docs."""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from hooc_perception.errors import HoocError
from hooc_perception.experiments import fingerprint, page, plan
from hooc_perception.experiments.run import run

DOCS = fingerprint.PACKAGE.parent / 'docs'


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(prog='python -m hooc_perception.experiments',
                                     description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('results'),
                        help='folder of all computed files (default: results)')
    parser.add_argument('--set', action='append', default=[], metavar='NAME[=FOLDER]',
                        help='a set to evaluate; twin needs no folder (default: twin)')
    parser.add_argument('--rows', nargs='+', metavar='ROW',
                        help=f'only these rows of {", ".join(plan.ROWS)} and, of sets with '
                             f'sequences, {plan.INCREMENTAL} (default: all; '
                             + '; '.join(f'of {name}: {", ".join(rows)}'
                                         for name, rows in plan.ROWS_OF.items()) + ')')
    parser.add_argument('--keep', nargs='+', default=[], metavar='ROW',
                        help='rows that are kept even though their code has changed')
    parser.add_argument('--force', nargs='+', default=[], metavar='ROW',
                        help='rows that are always recomputed')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=0,
                        help='parallel workers of the training, 0 = all cores')
    parser.add_argument('--docs', type=Path, default=DOCS,
                        help='folder of the pages that receive the tables')
    parser.add_argument('--dry-run', action='store_true', help='only print what would run and why')
    args = parser.parse_args(argv)
    try:
        sets = {name: folder or None
                for name, _, folder in (s.partition('=') for s in args.set or ['twin'])}
        steps = plan.steps_of(sets, args.out, args.rows, args.seed, args.jobs)
        records = run(steps, args.out, args.keep, args.force, args.dry_run)
        if not args.dry_run:
            for path in page.write_pages(sorted(args.docs.glob('results*.md')),
                                         args.docs / 'images', args.out, sets, records):
                print(path)
    except HoocError as e:
        print(f'results: {e}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('results: interrupted; run it again to resume', file=sys.stderr)
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
