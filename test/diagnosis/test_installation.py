# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The check of an installation: true about this one, and clear about broken ones."""

from pathlib import Path

from hooc_perception import extras
from hooc_perception.diagnosis import installation
from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING, worst
import pytest


def test_this_installation_has_what_it_needs():
    findings = [installation.check_python(), *installation.check_libraries(),
                *installation.check_packages(), installation.check_kernels()]
    assert worst(findings) != ERROR, [f for f in findings if f.level == ERROR]


def test_a_message_comes_back():
    pytest.importorskip('rclpy')
    finding = installation.check_ros()
    assert finding.level == OK, finding.text


def test_rendering_is_found_or_its_fix_named():
    finding = installation.check_gl()
    assert finding.level == OK or 'libosmesa6' in finding.text


@pytest.mark.parametrize('version', [(3, 10), (3, 14)])
def test_other_pythons_are_refused(version):
    finding = installation.check_python(version)
    assert finding.level == ERROR and f'{version[0]}.{version[1]}' in finding.text


def test_a_missing_library_names_its_package():
    finding, = installation.check_libraries({'libnothing.so.7': 'libnothing7'})
    assert finding.level == ERROR and 'apt-get install libnothing7' in finding.text


def test_a_package_that_does_not_import(monkeypatch, tmp_path):
    (tmp_path / 'broken_one.py').write_text(
        'raise ImportError("libusb-1.0.so.0: cannot open shared object file")')
    monkeypatch.syspath_prepend(tmp_path)
    findings = list(installation.check_packages({'broken_one': ('broken-one', 'pouring'),
                                                 'not_there': ('not-there', 'stirring')}))
    assert [f.level for f in findings] == [ERROR, ERROR]
    assert 'pouring' in findings[0].text and 'libusb-1.0-0' in findings[0].text
    assert 'make setup' in findings[1].text


def test_a_missing_extra_is_a_warning_that_names_it(monkeypatch):
    monkeypatch.setitem(extras.EXTRA_OF, 'not_there', 'train')
    finding, = installation.check_packages({'not_there': ('not-there', 'stirring')})
    assert finding.level == WARNING and 'stirring' in finding.text
    assert "pip install 'hooc_perception[train]'" in finding.text


def test_without_extras_only_the_plain_installation_is_checked(monkeypatch):
    for name in ('check_packages', 'check_resources'):
        monkeypatch.setattr(installation, name, lambda: ())
    for name in ('check_gl', 'check_ros', 'check_shared_memory'):
        monkeypatch.delattr(installation, name)
    monkeypatch.setattr(installation.importlib.util, 'find_spec', lambda name: None)
    assert [f.subject for f in installation.check_installation()] == ['Python', 'compiled code']


def test_a_version_that_is_not_the_pinned_one(monkeypatch):
    monkeypatch.setattr(installation, 'pinned', lambda: {'numpy': '0.0.1'})
    finding, = installation.check_packages({'numpy': ('numpy', 'anything')})
    assert finding.level == WARNING and '0.0.1' in finding.text


def test_pins_hold_where_setup_made_the_environment(monkeypatch, tmp_path):
    root = Path(installation.__file__).resolve().parents[2]
    monkeypatch.setattr(installation.sys, 'prefix', str(root / '.venv'))
    assert 'numpy' in installation.pinned()
    monkeypatch.setattr(installation.sys, 'prefix', str(tmp_path))
    assert installation.pinned() == {}


def test_no_shared_memory(tmp_path):
    assert installation.check_shared_memory(str(tmp_path / 'none')).level == WARNING
    assert installation.check_shared_memory(str(tmp_path), need_mb=1e9).level == WARNING
    assert installation.check_shared_memory(str(tmp_path), need_mb=0).level == OK


def test_worst():
    assert worst([]) == OK
    assert worst([Finding(OK, '', ''), Finding(ERROR, '', ''), Finding(WARNING, '', '')]) == ERROR
