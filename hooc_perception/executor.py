# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Where joblib runs parallel work: on the local cores or on a Dask cluster.

Everything that uses `joblib.Parallel` inside of `executor(...)` runs there. The results are the
same either way, because every piece of work has its own random stream.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
import hashlib
from importlib import import_module
from pathlib import Path
import platform
from typing import Any

from hooc_perception.errors import HoocError
import joblib

LOCAL = 'local'
CONNECT_S = 10.0
PACKAGE = Path(__file__).resolve().parent
# Another version of one of these may round differently.
DECISIVE = ('numpy', 'scipy', 'numba', 'mujoco', 'open3d', 'trimesh', 'manifold3d',
            'python-fcl')


@contextmanager
def executor(where: str = LOCAL) -> Iterator[None]:
    """
    Make joblib run its work at `where` within the block.

    Work that shares large arrays between threads (trees of a forest) stays in this process.

    :param where: 'local', or 'dask=ADDRESS' with the address of a Dask scheduler, whose workers
        have this package and the same versions of the libraries.
    :raises HoocError: where the text is something else, Dask is missing, no scheduler answers,
        or its workers are missing or run other code.
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


def spread(function: Callable[..., Any], *arguments: Iterable[Any]) -> Iterator[Any]:
    """
    Yield what `map` would: one call after the other locally, in parallel on a cluster.

    :param function: a module-level function, which the workers can import.
    """
    yield from joblib.Parallel(n_jobs=1, return_as='generator')(
        joblib.delayed(function)(*row) for row in zip(*arguments))


@contextmanager
def _client(address: str) -> Iterator[Any]:
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


def _check_workers(client: Any, address: str) -> None:
    """Raise HoocError unless there are workers and all of them run the same code as we do."""
    if not client.nthreads():
        raise HoocError(f'the Dask scheduler at {address!r} has no workers; start some with '
                        f'`dask worker {address} --nworkers -1 --nthreads 1`')
    try:
        answers = client.run(versions, on_error='return')
    except (OSError, RuntimeError, ImportError) as e:
        answers = {'a worker': e}
    check(answers, versions())


def check(answers: Mapping[str, Any], ours: Mapping[str, str]) -> None:
    """
    Raise HoocError where a worker differs from us.

    :param answers: {worker: its `versions()`, or the exception that was raised instead}.
    :param ours: our `versions()`.
    """
    for worker, theirs in sorted(answers.items()):
        if isinstance(theirs, BaseException):
            raise HoocError(f'{worker} of the cluster cannot run hooc_perception '
                            f'({_short(theirs)}); install the same version there')
        for name in ours:
            if theirs.get(name) != ours[name]:
                raise HoocError(f'{worker} of the cluster has {name} {theirs.get(name)}, here it '
                                f'is {ours[name]}, so results could differ; install the same '
                                'version there')


def versions() -> dict[str, str]:
    """Return {name: version} of everything that affects results; of our own code, a digest."""
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


def _short(error: BaseException) -> str:
    """Return the message of an error on one line."""
    return ' '.join(str(error).split())[:200] or type(error).__name__
