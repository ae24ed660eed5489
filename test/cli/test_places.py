# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where commands write is looked at before they begin."""

from hooc_perception.cli.main import main
from hooc_perception.cli.places import file_place, folder_place, page_place, relative_place
from hooc_perception.errors import HoocError
import pytest


def test_what_can_be_written_is_let_pass(tmp_path):
    (tmp_path / 'old.json').touch()
    assert file_place(None, '--json') is None and folder_place(None, '--plots') is None
    assert page_place(None, '--report') is None
    assert file_place(tmp_path / 'old.json', '--out') == tmp_path / 'old.json'
    for check in (file_place, folder_place, page_place):
        assert check(str(tmp_path / 'a' / 'b'), '--out') == tmp_path / 'a' / 'b'
    assert folder_place(tmp_path, '--out') == page_place(tmp_path, '--out') == tmp_path
    assert not (tmp_path / 'a').exists()


@pytest.mark.parametrize('check, path, said', [
    (file_place, 'folder', 'is a folder; name a file'),
    (folder_place, 'file', 'is a file; name a folder'),
    (page_place, 'file', 'is a file; name a folder'),
    (page_place, 'page.html', 'is a folder; name a file'),
    (page_place, 'taken', 'is a folder; name a file'),
    (file_place, 'file/x.json', 'is not a folder; choose another place'),
    (folder_place, 'file/a/b', 'is not a folder; choose another place'),
    (file_place, 'nowhere/x.json', 'is not a folder; choose another place')])
def test_what_cannot_is_refused(tmp_path, check, path, said):
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'file').touch()
    (tmp_path / 'page.html').mkdir()
    (tmp_path / 'taken' / 'report.html').mkdir(parents=True)
    (tmp_path / 'nowhere').symlink_to(tmp_path / 'gone')
    with pytest.raises(HoocError, match=f'^--out {tmp_path / path}.* {said}$'):
        check(tmp_path / path, '--out')


def test_a_folder_that_may_not_be_changed(tmp_path, monkeypatch):
    monkeypatch.setattr('os.access', lambda *_: False)
    with pytest.raises(HoocError, match='is write-protected; choose another place'):
        file_place(tmp_path / 'x', '--out')


def test_a_place_is_named_from_the_file_on(tmp_path):
    assert relative_place(tmp_path / 'set', tmp_path / 'out' / 'r.json') == '../set'


@pytest.mark.parametrize('words', [
    ['run', 'bag', '--model', 'm', '--out', '{folder}'],
    ['run', 'bag', '--model', 'm', '--out', 'x.json', '--report', '{file}'],
    ['run', 'bag', '--model', 'm', '--out', 'x.json', '--record', '{file}'],
    ['demo', '--out', '{file}'], ['twin', '--out', '{file}'],
    ['convert', 'set', '--out', '{file}'], ['train', 'set', '--out', '{file}'],
    ['bench', '--json', '{folder}'], ['bench', 'growth', '--plot', '{folder}'],
    ['bench', 'soak', '--json', '{folder}'],
    ['evaluate', 'set', 'r.json', '--json', '{folder}'],
    ['evaluate', 'set', 'r.json', '--markdown', '{folder}'],
    ['export', 'set', 'r.json', '--out', '{folder}'],
    ['evaluate', 'set', 'r.json', '--plots', '{file}'],
    ['baseline', 'set', '--method', 'ppf', '--out', '{folder}'],
    ['stages', 'set', '--model', 'm', '--json', '{folder}'],
    ['worst', 'set', 'r.json', '--out', '{file}'],
    ['report', 'r.json', '--out', '{file}']])
def test_every_command_looks_first(tmp_path, words, capsys):
    (tmp_path / 'file').touch()
    words = [word.format(file=tmp_path / 'file', folder=tmp_path) for word in words]
    assert main(words) == 1
    error, = capsys.readouterr().err.splitlines()
    assert error.startswith('hooc: --') and f' is a {"file" if "/file" in error else "folder"}; ' \
        in error
