# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench fuzz`: damaged bags, messages and models."""

from argparse import ArgumentParser, Namespace

from hooc_perception.errors import HoocError

HELP = ('Feed damaged bags, messages and models to everything that reads them. Each has to be '
        'read or rejected in one sentence. The exit code is 1 if a case crashes, hangs, runs out '
        'of memory or raises an unexpected exception.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--cases', type=int, default=1000, metavar='N',
                        help='number of cases (default: %(default)s, about a minute)')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')


def run(args: Namespace) -> int:
    """Run the fuzzer, print what came of it; return the exit code."""
    from hooc_perception.benchmark.fuzz import fuzz, READ, REJECTED
    from hooc_perception.evaluation.tables import Table, to_text
    from tqdm import tqdm
    if args.cases < 1:
        raise HoocError(f'--cases is {args.cases}; give the number of cases, 1 or more')
    result = fuzz(args.cases, args.seed,
                  lambda numbers: tqdm(numbers, desc='cases', disable=None))
    kinds = sorted({kind for kind, _ in result.outcomes})
    rows = tuple((kind, str(result.outcomes[kind, READ]), str(result.outcomes[kind, REJECTED]))
                 for kind in kinds)
    print(to_text(Table('Damaged input', ('', 'read', 'rejected'), rows, (
        f'{args.cases} cases of seed {args.seed}; {len(result.failures)} failed.',))))
    for number, kind, text in result.failures:
        print(f'case {number} ({kind}): {text}')
    return int(bool(result.failures))
