# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Train the network over the table again: `python -m hooc_perception.training.network --out FILE`.

It takes more than an hour on two cores and needs the extra `network`.
"""

from argparse import ArgumentParser
from pathlib import Path
import tempfile

from hooc_perception.io.scenes.scene_set import load_scene_set
from hooc_perception.objects.catalogue import TRAINING, write_catalogue
from hooc_perception.synthesis.population import relatives_of
from hooc_perception.training.network.examples import examples, ExamplesConfig
from hooc_perception.training.network.export import exported
from hooc_perception.training.network.fit import fit, NetworkFitConfig
from hooc_perception.training.network.weights import FILE, write
from hooc_perception.training.train import generic_models
import joblib
from tqdm import tqdm


def main() -> None:
    """Make the examples, fit the network, write its weights."""
    parser = ArgumentParser(prog='python -m hooc_perception.training.network',
                            description='Train the network over the table again.')
    parser.add_argument('--out', type=Path, default=FILE, help='weights to write (.npz)')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=0, help='worker processes, 0 = all cores')
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        catalogue = load_scene_set(write_catalogue(folder), with_scenes=False)
        models = generic_models(catalogue, args.seed, progress=True)
        jobs = args.jobs or joblib.cpu_count()
        relatives = relatives_of(models, args.seed, jobs, TRAINING)
        config = ExamplesConfig()
        with tqdm(total=config.arrangements, desc='synthetic scenes', unit='scene') as bar:
            made = examples(models, relatives, catalogue.cameras, config, args.seed, jobs,
                            bar.update)
    network = fit(made, len(models) + 1, NetworkFitConfig(), args.seed, print)
    write(args.out, exported(network))
    print(f'wrote {args.out}')


if __name__ == '__main__':
    main()
