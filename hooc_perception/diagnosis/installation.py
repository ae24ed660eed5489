# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check that everything the package depends on works, by using it."""

from collections.abc import Iterator, Mapping
import ctypes
import importlib
import importlib.metadata
import importlib.util
import os
from pathlib import Path
import platform
import re
import shutil
import subprocess
import sys
import tempfile

from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.extras import advice

PYTHONS = ((3, 11), (3, 12))
# Module -> (distribution, what does not work without it).
PACKAGES: dict[str, tuple[str, str]] = {
    'numpy': ('numpy', 'everything'), 'scipy': ('scipy', 'everything'),
    'numba': ('numba', 'everything'),
    'yaml': ('PyYAML', 'scene sets'), 'cv2': ('opencv-contrib-python-headless', 'scene sets'),
    'trimesh': ('trimesh', 'meshes'), 'manifold3d': ('manifold3d', 'mesh repair'),
    'fcl': ('python-fcl', 'training'), 'mujoco': ('mujoco', 'training with the best profile'),
    'sklearn': ('scikit-learn', 'evaluation'), 'rosbags': ('rosbags', 'bags'),
    'mcap': ('mcap', 'bags'),
    'open3d': ('open3d', 'evaluation baselines'),
    'pyrender': ('pyrender', 'shaded images in reports'),
    'matplotlib': ('matplotlib', 'plots'), 'jinja2': ('Jinja2', 'reports'),
    'PIL': ('pillow', 'images'), 'tqdm': ('tqdm', 'progress bars'),
    'psutil': ('psutil', 'benchmarks'), 'rclpy': ('ros-jazzy-rclpy', 'the nodes'),
    'yourdfpy': ('yourdfpy', 'masking a robot by its URDF'),
}
# Shared library -> the Debian and Ubuntu package that holds it.
LIBRARIES = {'libusb-1.0.so.0': 'libusb-1.0-0', 'libGL.so.1': 'libgl1', 'libEGL.so.1': 'libegl1',
             'libgomp.so.1': 'libgomp1', 'libXrender.so.1': 'libxrender1'}
SETUP = ('run "make setup" in the source tree, or "pip install -r requirements-ros.txt" next to a '
         'ROS installation')
LOW_DISK_GB, LOW_MEMORY_GB = 1.0, 4.0

GL_PROBE = """
import numpy
numpy.infty = numpy.inf
import pyrender, trimesh
scene = pyrender.Scene()
scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box()))
pose = trimesh.transformations.translation_matrix([0, 0, 3])
scene.add(pyrender.PerspectiveCamera(1.0), pose=pose)
depth = pyrender.OffscreenRenderer(32, 32).render(scene)[1]
assert abs(depth[16, 16] - 2.5) < 0.02, 'wrong picture'
"""

ROS_PROBE = """
import os, sys, time
import rclpy
from rclpy.qos import QoSProfile
from std_msgs.msg import String
rclpy.init(args=['--ros-args', '--log-level', 'fatal'])
node = rclpy.create_node('hooc_doctor')
heard = []
node.create_subscription(String, 'hooc_doctor_probe', heard.append, QoSProfile(depth=1))
publisher = node.create_publisher(String, 'hooc_doctor_probe', QoSProfile(depth=1))
end = time.monotonic() + 10
while not heard and time.monotonic() < end:
    publisher.publish(String(data='x'))
    rclpy.spin_once(node, timeout_sec=0.1)
print(rclpy.get_rmw_implementation_identifier(), os.path.dirname(rclpy.__file__))
node.destroy_node()
rclpy.try_shutdown()
sys.exit(not heard)
"""


def check_installation() -> Iterator[Finding]:
    """Yield a Finding for each check of this installation, cheap ones first."""
    yield check_python()
    yield from check_libraries()
    yield from check_packages()
    yield check_kernels()
    # What an extra brings is checked where it is installed.
    if importlib.util.find_spec('pyrender'):
        yield check_gl()
    if importlib.util.find_spec('rclpy'):
        yield check_ros()
        yield check_shared_memory()
    yield from check_resources()


def check_python(version: tuple[int, int] | None = None) -> Finding:
    """Return the Finding on the interpreter; `version` is (major, minor), None = this one's."""
    version = version or sys.version_info[:2]
    text = f'{platform.python_version()} in {sys.prefix}'
    if version in PYTHONS:
        return Finding(OK, 'Python', text)
    return Finding(ERROR, 'Python', f'{version[0]}.{version[1]} is not supported; '
                   'install Python 3.12 or 3.11, remove .venv and set up again: ' + SETUP)


def check_libraries(libraries: Mapping[str, str] | None = None) -> Iterator[Finding]:
    """
    Yield a Finding for each system library.

    :param libraries: {file name: Debian package}; None stands for those of open3d and pyrender,
        where one of the two is installed.
    """
    if libraries is None:
        wanted = any(importlib.util.find_spec(name) for name in ('open3d', 'pyrender'))
        libraries = LIBRARIES if wanted else {}
    for name, package in libraries.items():
        try:
            ctypes.CDLL(name)
            yield Finding(OK, name, 'found')
        except OSError:
            yield Finding(ERROR, name,
                          f'not found; run "apt-get install {package}" as root')


def check_packages(packages: Mapping[str, tuple[str, str]] | None = None) -> Iterator[Finding]:
    """Yield a Finding for each Python package (as PACKAGES), by importing it."""
    pins = pinned()
    for module, (name, need) in (PACKAGES if packages is None else packages).items():
        try:
            importlib.import_module(module)
        except Exception as error:      # a broken library may raise anything when imported
            hint = advice(error) if isinstance(error, ImportError) else None
            if hint:
                yield Finding(WARNING, name, f'optional, for {need}: {hint}')
                continue
            yield Finding(ERROR, name, f'does not import ({_one_line(error)}), so {need} will '
                          f'fail; {_fix(error)}')
            continue
        version = _version(name)
        pin = pins.get(name.lower())
        if pin and version and pin != version:
            yield Finding(WARNING, name, f'{version} is installed, but the tests ran with '
                          f'{pin}; {SETUP}')
        else:
            yield Finding(OK, name, version or 'found')


def pinned() -> dict[str, str]:
    """
    Return {lower-case name: version} of requirements.txt where `make setup` made this environment.

    {} elsewhere: other environments have versions of their own, those of apt next to ROS.
    """
    root = Path(__file__).resolve().parents[2]
    path = root / 'requirements.txt'
    if Path(sys.prefix).resolve() != (root / '.venv').resolve() or not path.is_file():
        return {}
    lines = (line.split(';')[0].strip().partition('==') for line in path.read_text().splitlines()
             if '==' in line and not line.startswith('#'))
    return {name: version for name, _, version in lines}


def check_kernels() -> Finding:
    """Return the Finding on compiled code: whether a kernel runs, and where its cache is."""
    try:
        from hooc_perception.core.kernels import raster
        import numpy as np
        raster.project_vertices(np.ones((1, 3)), np.eye(3), np.zeros(3), 1.0, 1.0, 0.0, 0.0)
        cache = raster.project_vertices.stats.cache_path
    except Exception as error:
        return Finding(ERROR, 'compiled code', f'a kernel does not run ({_one_line(error)}); '
                       'set NUMBA_CACHE_DIR to a folder that you can write to')
    return Finding(OK, 'compiled code', f'cached in {cache}')


def check_gl() -> Finding:
    """Return the Finding on off-screen rendering: EGL, else OSMesa, else none."""
    errors = {}
    for name in ('egl', 'osmesa'):
        run = _probe(GL_PROBE, {'PYOPENGL_PLATFORM': name})
        if run.returncode == 0:
            return Finding(OK, 'rendering', f'pyrender renders with {name.upper()}')
        errors[name] = _last_line(run.stderr)
    return Finding(WARNING, 'rendering', f'pyrender renders neither with EGL ({errors["egl"]}) '
                   'nor with OSMesa, so reports get simpler images; run "apt-get install libegl1 '
                   'libgl1-mesa-dri" or "apt-get install libosmesa6" as root')


def check_ros() -> Finding:
    """Return the Finding on ROS: whether a message passes through the middleware."""
    run = _probe(ROS_PROBE, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'})
    if run.returncode == 0:
        rmw, place = run.stdout.split(None, 1)
        text = f'a message passed through {rmw}; rclpy is in {place.strip()}'
        distro = os.environ.get('ROS_DISTRO')
        if distro and distro != 'jazzy':
            return Finding(WARNING, 'ROS', f'it works, but ROS {distro} is sourced and these '
                           'nodes are built for Jazzy; open a shell without it')
        return Finding(OK, 'ROS', text)
    if os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') != 'rmw_fastrtps_cpp':
        return Finding(ERROR, 'ROS', f'the middleware {os.environ["RMW_IMPLEMENTATION"]} is not '
                       'installed here; unset RMW_IMPLEMENTATION')
    return Finding(ERROR, 'ROS', 'no message passes through the middleware '
                   f'({_last_line(run.stderr) or "no error was printed"}); check that the '
                   'loopback network is up and that no firewall blocks UDP on it')


def check_shared_memory(folder: str = '/dev/shm', need_mb: float = 640) -> Finding:
    """
    Return the Finding on shared memory, the fastest transport for images.

    :param need_mb: what the transport profile of the supervisor needs: 8 processes x 64 MB x
        1.25.
    """
    if not os.path.isdir(folder):
        return Finding(WARNING, 'shared memory', f'{folder} is missing, so images use a slower '
                       'transport; mount a tmpfs there')
    free = shutil.disk_usage(folder).free / 2 ** 20
    if free < need_mb:
        return Finding(WARNING, 'shared memory', f'{folder} has {free:.0f} MB free of the '
                       f'{need_mb:g} MB that the fast transport needs, so images use a slower '
                       'one; remove stale files there, or start the container with --shm-size=1g')
    return Finding(OK, 'shared memory', f'{free / 1024:.1f} GB free')


def check_resources() -> Iterator[Finding]:
    """Yield the Findings on disk space and memory."""
    for place in dict.fromkeys((os.getcwd(), tempfile.gettempdir())):
        free = shutil.disk_usage(place).free / 2 ** 30
        low = free < LOW_DISK_GB
        yield Finding(WARNING if low else OK, 'disk', f'{free:.1f} GB free in {place}'
                      + ('; free some space before training or recording' if low else ''))
    memory = os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2 ** 30
    low = memory < LOW_MEMORY_GB
    yield Finding(WARNING if low else OK, 'memory', f'{memory:.1f} GB, {os.cpu_count()} cores'
                  + ('; training may need 4 GB' if low else ''))


def _probe(code: str, variables: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """Run Python code in a process of its own, so that a crash becomes a finding."""
    try:
        return subprocess.run([sys.executable, '-c', code], env={**os.environ, **variables},
                              capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired as error:
        return subprocess.CompletedProcess(error.cmd, 124, '', 'no response within 60 s')


def _fix(error: Exception) -> str:
    """Return the fix for a failed import."""
    found = re.search(r'(lib[\w.+-]+\.so[.\d]*)', str(error))
    if found and found[1] in LIBRARIES:
        return f'run "apt-get install {LIBRARIES[found[1]]}" as root'
    return SETUP


def _version(name: str) -> str | None:
    """Return the installed version of a distribution, None if it has no metadata."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _one_line(error: Exception) -> str:
    """Return an exception as one short line."""
    return (' '.join(str(error).split()) or type(error).__name__)[:160]


def _last_line(text: str) -> str:
    """Return the last line of an error output, shortened."""
    lines = text.strip().splitlines()
    return lines[-1].strip()[:160] if lines else ''
