# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Where work that joblib spreads runs: on the cores at hand, or on a Dask cluster.

Whatever is computed through `joblib.Parallel` inside of `executor(...)` goes there; the results
are the same either way, because every piece of work draws from its own random stream.
"""

from contextlib import contextmanager, suppress
import hashlib
from importlib import import_module
from pathlib import Path
import platform

from hooc_perception.errors import HoocError
import joblib

LOCAL = 'local'
CONNECT_S = 10.0
PACKAGE = Path(__file__).resolve().parent
# Another version of one of these may round in another way.
DECISIVE = ('numpy', 'scipy', 'numba', 'mujoco', 'open3d', 'trimesh', 'manifold3d',
            'python-fcl')


@contextmanager
def executor(where=LOCAL):
    """
    Let joblib run in the block where `where` says.

    Work that shares large arrays between threads (trees of a forest) stays in this process.

    :param where: 'local', or 'dask=ADDRESS' with the address of a Dask scheduler, whose workers
        have this package and the same versions of the libraries.
    :raises HoocError: another text, Dask missing, nobody at the address, no workers, or
        workers with other code.
    """
    name, equals, address = where.partition('=')
    if where == LOCAL:
        yield
    elif name == 'dask' and equals and address:
        with _client(address) as client, joblib.parallel_config('dask', client=client):
            yield
    else:
        raise HoocError(f'--executor is {where!r}; write local, or dask=ADDRESS with the address '
                        'of a Dask scheduler, such as dask=tcp://10.0.0.1:8786')


def spread(function, *arguments):
    """
    Yield what `map` would: one call after the other here, side by side on a cluster.

    :param function: importable under its name by the workers; `arguments`: iterables.
    """
    yield from joblib.Parallel(n_jobs=1, return_as='generator')(
        joblib.delayed(function)(*row) for row in zip(*arguments))


@contextmanager
def _client(address):
    """Yield a connected distributed.Client whose workers run the same code as we do."""
    try:
        distributed = import_module('distributed')
    except ImportError as e:
        raise HoocError(f'--executor dask needs the library distributed ({e}); install it with '
                        "pip install 'hooc_perception[dask]'") from None
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as e:
        raise HoocError(f'no Dask scheduler answers at {address!r} ({_short(e)}); start one with '
                        '`dask scheduler` and give the address that it prints') from None
    try:
        _check_workers(client, address)
        yield client
    finally:
        with suppress(OSError, TimeoutError):
            client.close(timeout=CONNECT_S)


def _check_workers(client, address):
    """Raise HoocError unless there are workers and all of them run the code that we run."""
    if not client.nthreads():
        raise HoocError(f'the Dask scheduler at {address!r} has no workers; start some with '
                        f'`dask worker {address} --nworkers -1 --nthreads 1`')
    try:
        answers = client.run(versions, on_error='return')
    except (OSError, RuntimeError, ImportError) as e:
        answers = {'a worker': e}
    check(answers, versions())


def check(answers, ours):
    """
    Raise HoocError where a worker differs from us.

    :param answers: {worker: its `versions()`, or the exception that it met instead}.
    :param ours: our `versions()`.
    """
    for worker, theirs in sorted(answers.items()):
        if isinstance(theirs, BaseException):
            raise HoocError(f'{worker} of the cluster cannot run hooc_perception '
                            f'({_short(theirs)}); install the same version there')
        for name in ours:
            if theirs.get(name) != ours[name]:
                raise HoocError(f'{worker} of the cluster has {name} {theirs.get(name)}, here it '
                                f'is {ours[name]}; results could differ; install the same there')


def versions():
    """Return {name: version} of all that decides about results; of our own code, a digest."""
    from importlib.metadata import PackageNotFoundError, version
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob('*.py')):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b'\0')
        digest.update(path.read_bytes())
    found = {'hooc_perception': digest.hexdigest()[:12],
             'python': '.'.join(platform.python_version_tuple()[:2])}
    for name in DECISIVE:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _short(error):
    """Return the message of an error on one line."""
    return ' '.join(str(error).split())[:200] or type(error).__name__
