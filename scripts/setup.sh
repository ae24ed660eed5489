#!/usr/bin/env bash
# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
#
# Sets everything up on Debian 12, Ubuntu 24.04 or later, as root or with sudo: system libraries
# where they are missing, .venv with Python 3.12 or 3.11, pinned packages, the package itself.
# A second run ends at once. Environment: HOOC_PYTHON names the interpreter to use,
# HOOC_NO_APT=1 leaves the system alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

VENV=.venv
STAMP=$VENV/.hooc_setup
# open3d: libusb, libGL, libEGL, libgomp. pyrender: libEGL with Mesa, and libXrender for pyglet.
LIBRARIES=(libusb-1.0-0 libgl1 libegl1 libgl1-mesa-dri libgomp1 libxrender1)

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

fingerprint() {
  cat requirements.txt pyproject.toml setup.py setup.cfg package.xml scripts/setup.sh \
    scripts/ros_first.py | sha256sum | cut -d' ' -f1
}

# --- nothing to do? ---------------------------------------------------------------------------
# The path is part of the stamp: a virtual environment does not survive a move.
WANTED="$(fingerprint) $PWD"
if [[ -f $STAMP && $(<"$STAMP") == "$WANTED" ]] && "$VENV/bin/python" -c '' 2>/dev/null; then
  exit 0
fi

# --- system packages --------------------------------------------------------------------------
as_root() {
  if [[ $EUID -eq 0 ]]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else return 1; fi
}

UPDATED=''
apt_install() {
  [[ -z ${HOOC_NO_APT:-} ]] && command -v apt-get >/dev/null || return 1
  if [[ -z $UPDATED ]]; then
    as_root apt-get update -qq >/dev/null || say 'apt-get update failed; trying with the lists there are'
    UPDATED=1
  fi
  as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 "$@" >/dev/null
}

missing_packages() {
  local name
  for name in "$@"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null) == installed ]] || echo "$name"
  done
}

if command -v dpkg-query >/dev/null; then
  mapfile -t MISSING < <(missing_packages "${LIBRARIES[@]}")
  if [[ ${#MISSING[@]} -gt 0 ]]; then
    say "installing system libraries: ${MISSING[*]}"
    # One by one where all at once fails: a release may lack one that only some features need.
    apt_install "${MISSING[@]}" || for name in "${MISSING[@]}"; do
      apt_install "$name" || say "could not install $name; if something fails later, install it by hand"
    done
  fi
else
  say "no dpkg here: make sure that these libraries are installed: ${LIBRARIES[*]}"
fi

# --- Python -----------------------------------------------------------------------------------
# Tried by running: a pyenv shim may be on the PATH and still start nothing, and Debian's python3
# comes without ensurepip until python3-venv is there.
runs() { "$1" -c 'import sys; sys.exit(sys.version_info[:2] not in ((3, 12), (3, 11)))' 2>/dev/null; }
makes_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }

find_python() {
  local test=$1 name
  for name in ${HOOC_PYTHON:+"$HOOC_PYTHON"} python3.12 /usr/bin/python3.12 python3.11 \
      /usr/bin/python3.11 python3 /usr/bin/python3; do
    if runs "$name" && "$test" "$name"; then
      "$name" -c 'import sys; print(sys.executable)'
      return 0
    fi
  done
  return 1
}

if ! "$VENV/bin/python" -c 'import pip' 2>/dev/null; then
  [[ -z ${HOOC_PYTHON:-} ]] || runs "$HOOC_PYTHON" \
    || die "HOOC_PYTHON='$HOOC_PYTHON' does not start Python 3.12 or 3.11; correct it or unset it"
  PYTHON=$(find_python makes_venv || true)
  if [[ -z $PYTHON ]]; then
    BARE=$(find_python true || true)
    if [[ -n $BARE ]]; then
      say 'installing the venv module of Python'
      apt_install "python$("$BARE" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv" || true
    else
      say 'installing Python'
      apt_install python3 python3-venv || true
    fi
    PYTHON=$(find_python makes_venv || true)
  fi
  [[ -n $PYTHON ]] || die 'no Python 3.12 or 3.11 with the venv module found; install python3 and python3-venv, or set HOOC_PYTHON'
  say "creating $VENV with $("$PYTHON" --version 2>&1) ($PYTHON)"
  rm -rf "$VENV"
  "$PYTHON" -m venv "$VENV"
fi

# --- packages ---------------------------------------------------------------------------------
rm -f "$STAMP"
export PIP_DISABLE_PIP_VERSION_CHECK=1
say 'installing the pinned Python packages (about 1 GB on disk; a few minutes on a slow line)'
# The plain build of OpenCV, which older environments hold, owns the same files as the contrib one.
if "$VENV/bin/python" -m pip show -q opencv-python-headless 2>/dev/null; then
  "$VENV/bin/python" -m pip uninstall -qqq -y opencv-python-headless opencv-contrib-python-headless
fi
# The list is complete, so nothing needs resolving.
"$VENV/bin/python" -m pip install -q --no-deps --use-pep517 -r requirements.txt
"$VENV/bin/python" -m pip install -q --no-deps --no-build-isolation --editable .

SITE=$("$VENV/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
cp scripts/ros_first.py "$SITE/hooc_ros_first.py"
# Named so that it is read before the ROS wheels' own ros_wheels_bootstrapper.pth.
echo 'import hooc_ros_first' > "$SITE/hooc_ros_first.pth"

"$VENV/bin/python" -c 'import numpy, numba, open3d, trimesh, fcl, mujoco, rosbags, rclpy' \
  || die 'the packages are installed but do not import; the line above says which system library is missing'
echo "$WANTED" > "$STAMP"
say "ready: $VENV/bin/hooc --help"
