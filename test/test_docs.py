# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The documentation keeps up with the code: links lead somewhere, commands exist."""

import argparse
import importlib
import os
from pathlib import Path
import re
import subprocess
import sys
import tomllib

from hooc_perception.cli import main as cli
import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md')])


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    text = re.sub(r'```.*?```', '', page.read_text(), flags=re.S)
    broken = [target for target in re.findall(r'\]\(([^)\s]+)\)', text)
              if not target.startswith(('http', '#', 'mailto:'))
              and not (page.parent / target.split('#')[0]).exists()]
    assert not broken


def test_the_index_lists_every_page():
    index = (ROOT / 'docs' / 'README.md').read_text()
    unlisted = [path.name for path in (ROOT / 'docs').glob('*.md')
                if path.name != 'README.md' and f'({path.name})' not in index]
    assert not unlisted


def commands_of(page):
    """Yield the words of each `hooc ...` line in the code blocks of a page."""
    for block in re.findall(r'```(?:bash|sh|console)?\n(.*?)```', page.read_text(), re.S):
        for line in block.splitlines():
            found = re.search(r'(?:^|\s|/)hooc (?=[a-z])(.*)', line.split('#')[0])
            if found:
                yield found[1].split()


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_have_the_options_that_the_page_shows(page):
    for command, *words in commands_of(page):
        assert command in cli.COMMANDS, command
        if command not in cli.available():
            continue
        parser = argparse.ArgumentParser()
        importlib.import_module(f'hooc_perception.cli.{command}').add_arguments(parser)
        for tools in (a for a in parser._actions if isinstance(a, argparse._SubParsersAction)):
            assert words[0] in tools.choices, command
            parser = tools.choices[words[0]]
        known = set(parser._option_string_actions)
        assert {word.split('=')[0] for word in words if word.startswith('--')} <= known, command


def test_the_page_of_commands_lists_every_command():
    page = (ROOT / 'docs' / 'commands.md').read_text()
    assert not [name for name in cli.COMMANDS if f'| `hooc {name}` |' not in page]


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_imports_of_the_page_exist(page):
    blocks = re.findall(r'```python\n(.*?)```', page.read_text(), re.S)
    for module, names in re.findall(r'^from (hooc_perception[\w.]*) import (.+)$',
                                    '\n'.join(blocks), re.M):
        found = importlib.import_module(module)
        assert not [name for name in names.split(', ') if not hasattr(found, name)], module


def test_every_direct_dependency_is_explained():
    text = (ROOT / 'docs' / 'libraries.md').read_text().lower()
    project = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
    rows = [*project['dependencies'], *(row for extra in ('train', 'eval', 'view', 'dask')
                                        for row in project['optional-dependencies'][extra])]
    names = {re.match(r'[\w-]+', row)[0] for row in rows}
    aliases = {'opencv-contrib-python-headless': 'opencv', 'networkx': 'trimesh',
               'MarkupSafe': 'jinja2'}
    missing = [name for name in names if aliases.get(name, name).lower() not in text]
    assert not missing


@pytest.mark.parametrize('page', ['troubleshooting.md', 'planners.md'])
def test_names_of_parameters_and_reasons_exist(page):
    """A name in the pages that are read in need, such as `max_frame_age_s`, is one in the code."""
    code = '\n'.join(path.read_text() for path in (ROOT / 'hooc_perception').rglob('*.py'))
    text = re.sub(r'```.*?```', '', (ROOT / 'docs' / page).read_text(), flags=re.S)
    names = {name.rpartition('.')[2] for name in re.findall(r'`([a-z][a-z_.]*_[a-z_.]*)`', text)}
    unknown = {name for name in names if not re.search(rf'\b{re.escape(name)}\b', code)}
    assert len(names) > 1 and not unknown


def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip('mkdocs')
    pytest.importorskip('mkdocstrings')
    command = [sys.executable, '-m', 'mkdocs', 'build', '--strict', '-q', '-d', str(tmp_path)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True,
                         env={**os.environ, 'NO_MKDOCS_2_WARNING': '1'})
    assert run.returncode == 0, run.stdout + run.stderr
    page = (tmp_path / 'api' / 'index.html').read_text()
    assert 'id="hooc_perception.parser.Parser.parse"' in page
    assert '<pre class="mermaid">' in (tmp_path / 'index.html').read_text()
