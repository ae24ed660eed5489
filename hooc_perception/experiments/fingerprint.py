# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fingerprints of inputs and of the code that a step runs: they say what has to run again."""

import ast
from collections.abc import Iterable, Iterator
import functools
import hashlib
from pathlib import Path
import subprocess

PACKAGE = Path(__file__).resolve().parent.parent


def of_path(path: str | Path) -> str:
    """Return a hex digest of a file, or of the names and contents of all files of a folder."""
    path, digest = Path(path), hashlib.sha256()
    for file in sorted(path.rglob('*')) if path.is_dir() else [path]:
        if file.is_file():
            digest.update(file.relative_to(path).as_posix().encode() + b'\0')
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:16]


def _file(module: str) -> Path | None:
    """Return the file of a module of this package, None where there is none."""
    stem = PACKAGE.joinpath(*module.split('.')[1:])
    for path in (stem.with_suffix('.py'), stem / '__init__.py'):
        if path.exists():
            return path
    return None


def _imported(tree: ast.AST) -> Iterator[str]:
    """Yield the dotted names of this package that a module imports, functions included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f'{node.module}', *(f'{node.module}.{alias.name}' for alias in node.names)]
        else:
            continue
        yield from (name for name in names if name.split('.')[0] == PACKAGE.name)


@functools.cache
def _parsed(path: Path) -> tuple[bytes, frozenset[str]]:
    """Return (digest of the code, names that it imports) of a file; comments do not count."""
    tree = ast.parse(path.read_text(), str(path))
    names = frozenset(_imported(tree))
    for node in ast.walk(tree):
        if (isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
                and ast.get_docstring(node) is not None):
            node.body = node.body[1:]
    return hashlib.sha256(ast.dump(tree).encode()).digest(), names


def modules_of(roots: Iterable[str]) -> list[str]:
    """Return the sorted names of the modules that `roots` import, themselves included."""
    seen: set[str] = set()
    open_ = list(roots)
    while open_:
        name = open_.pop()
        path = _file(name)
        if path is not None and name not in seen:
            seen.add(name)
            open_ += _parsed(path)[1]
    return sorted(seen)


def of_code(roots: Iterable[str]) -> str:
    """Return a hex digest of the code of `roots` and of all of this package they import."""
    digest = hashlib.sha256()
    for name in modules_of(roots):
        if path := _file(name):
            digest.update(name.encode() + b'\0' + _parsed(path)[0])
    return digest.hexdigest()[:16]


def commit() -> str:
    """Return the short commit of the source tree, + for uncommitted changes, '' without git."""
    def git(*arguments: str) -> str:
        return subprocess.run(['git', '-C', str(PACKAGE.parent), *arguments], check=True,
                              capture_output=True, text=True).stdout.strip()
    try:
        changed = git('status', '--porcelain', '--untracked-files=no', '--', PACKAGE.name)
        return git('rev-parse', '--short', 'HEAD') + ('+' if changed else '')
    except (OSError, subprocess.CalledProcessError):
        return ''
