# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A robot as its URDF describes it: the shape of every link, and where the joints put it."""

from collections.abc import Callable, Iterable, Mapping
import io
from pathlib import Path
from typing import Any, cast

from hooc_perception.core.arrays import Float64Array
from hooc_perception.errors import HoocError
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] - no stubs
import numpy as np
import trimesh
import yourdfpy

# Returns the share folder of a ROS package, None if it is not installed.
PackageFinder = Callable[[str], str | None]
MAX_FACES = 2 * 10**6
# Joints with one coordinate, which is what JointState carries.
_MOVABLE = {'revolute', 'continuous', 'prismatic'}


class RobotDescription:
    """
    The links and joints of a URDF.

    :ivar name: of the robot; `root` its root link; `links` the names of all.
    :ivar joints: the names of the joints that have a position of their own: neither fixed nor
        following another one (mimic).
    :ivar shapes: {link: its mesh in its own frame, metres}, links without a shape left out. Of a
        link without visual shapes, or whose files are missing, the collision shapes are taken.
    """

    def __init__(self, urdf: str, ignore: Iterable[str] = (),
                 find_package: PackageFinder = lambda name: None) -> None:
        """
        Read the text of a URDF, as robot_state_publisher gets it.

        :param ignore: names of links whose shapes are not wanted.
        :param find_package: resolves mesh files such as package://my_robot/meshes/link.stl.
        :raises HoocError: if it is no URDF, or a mesh file of a link cannot be read.
        """
        self._urdf = _parsed(urdf)
        robot = self._urdf.robot
        self.name: str = robot.name or 'robot'
        self.links: tuple[str, ...] = tuple(link.name for link in robot.links)
        self.root = str(self._urdf.base_link)
        self.joints: tuple[str, ...] = tuple(
            joint.name for joint in robot.joints
            if joint.type in _MOVABLE and joint.mimic is None)
        self.unposable: tuple[str, ...] = tuple(
            joint.name for joint in robot.joints if joint.type in ('floating', 'planar'))
        unknown = sorted(set(ignore) - set(self.links))
        if unknown:
            raise HoocError(f'the robot {self.name} has no link {unknown[0]!r}; its links are '
                            f'{", ".join(self.links)}')
        self.shapes: dict[str, trimesh.Trimesh] = {}
        for link in robot.links:
            shape = None if link.name in ignore else _shape(link, find_package)
            if shape is not None:
                self.shapes[link.name] = shape

    def link_poses(self, positions: Mapping[str, float]) -> dict[str, Float64Array]:
        """
        Return {link: T_root_link (4, 4)} by forward kinematics.

        :param positions: {joint: radians or metres}; may hold joints of other robots.
        :raises HoocError: if a joint of this robot is missing or has more than one coordinate.
        """
        if self.unposable:
            raise HoocError(f'the joint {self.unposable[0]} of the robot {self.name} is floating '
                            'or planar: its position is no single number; publish /tf instead')
        missing = [name for name in self.joints if name not in positions]
        if missing:
            raise HoocError(f'the position of {", ".join(missing)} is not known')
        self._urdf.update_cfg({name: float(positions[name]) for name in self.joints})
        return {name: np.array(self._urdf.get_transform(name, self.root)) for name in self.links}


def _parsed(text: str) -> yourdfpy.URDF:
    """Return the URDF object of a text; HoocError if it is none."""
    data = text.encode()
    try:
        root = etree.fromstring(data)
    except etree.XMLSyntaxError as error:
        raise HoocError(f'robot_description is not XML ({error}); give the text of a URDF, as '
                        'robot_state_publisher gets it') from error
    if root.tag != 'robot':
        raise HoocError(f'robot_description holds <{root.tag}>, not <robot>; give the text of a '
                        'URDF, as robot_state_publisher gets it')
    if any('xacro' in (element.prefix or '') for element in root.iter(etree.Element)):
        raise HoocError('robot_description still holds xacro macros; run xacro on it first')
    try:
        urdf = yourdfpy.URDF.load(io.BytesIO(data), load_meshes=False)
    except Exception as error:      # whatever its parser trips over
        raise HoocError(f'robot_description cannot be read as URDF '
                        f'({type(error).__name__}: {error}); check it with check_urdf') from error
    if not urdf.robot.links or urdf.base_link is None:
        raise HoocError('robot_description has no root link; check it with check_urdf')
    return urdf


def _shape(link: Any, find_package: PackageFinder) -> trimesh.Trimesh | None:
    """Return the mesh of a yourdfpy Link in its own frame, None if it has no shape."""
    trouble = None
    for elements in (link.visuals, link.collisions):
        try:
            meshes = [_element(element, find_package) for element in elements
                      if element.geometry is not None]
        except HoocError as error:
            trouble = trouble or error
            continue
        if meshes:
            return cast(trimesh.Trimesh, trimesh.util.concatenate(meshes))
    if trouble:
        raise HoocError(f'link {link.name}: {trouble}')
    return None


def _element(element: Any, find_package: PackageFinder) -> trimesh.Trimesh:
    """Return the mesh of a Visual or Collision in the frame of its link."""
    geometry = element.geometry
    if geometry.box is not None:
        mesh = trimesh.creation.box(extents=geometry.box.size)
    elif geometry.sphere is not None:
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)
    elif geometry.cylinder is not None:
        mesh = trimesh.creation.cylinder(geometry.cylinder.radius, geometry.cylinder.length)
    elif geometry.mesh is not None:
        mesh = _mesh_file(geometry.mesh.filename, find_package)
        if geometry.mesh.scale is not None:
            mesh.apply_scale(geometry.mesh.scale)
    else:
        raise HoocError('it has a shape that is no box, sphere, cylinder or mesh; use one of them')
    if element.origin is not None:
        mesh.apply_transform(element.origin)
    return mesh


def _mesh_file(name: str, find_package: PackageFinder) -> trimesh.Trimesh:
    """Return the mesh of a file that a URDF names, in metres; HoocError if it cannot be read."""
    path = _path(name, find_package)
    try:
        scene = trimesh.load_scene(str(path), process=False, skip_materials=True)
        mesh = scene.to_mesh()
        if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
            raise ValueError('it holds no finite triangles')
    except Exception as error:      # the parsers raise whatever arbitrary bytes make them
        raise HoocError(f'the mesh {path} cannot be read ({type(error).__name__}: {error}); '
                        'export it again') from error
    if len(mesh.faces) > MAX_FACES:
        raise HoocError(f'the mesh {path} has {len(mesh.faces)} faces, more than {MAX_FACES}; '
                        'simplify it')
    if path.suffix.lower() == '.dae':
        mesh.apply_scale(_collada_unit(path))
    return mesh


def _path(name: str, find_package: PackageFinder) -> Path:
    """Return the path of a mesh file; HoocError if there is none."""
    kind, separator, rest = name.partition('://')
    if not separator:
        path = Path(name)
    elif kind == 'package':
        package, _, inner = rest.partition('/')
        folder = find_package(package)
        if folder is None:
            raise HoocError(f'its mesh {name} lies in the package {package}, which is not '
                            'installed here; install it and source its workspace, or name the '
                            'link in robot_ignore_links')
        path = Path(folder) / inner
    elif kind == 'file':
        path = Path(rest)
    else:
        raise HoocError(f'its mesh {name} is not a file; use package:// or file://')
    if not path.is_file():
        raise HoocError(f'its mesh {name} does not exist (looked for {path}); install the package '
                        'of the robot, or name the link in robot_ignore_links')
    return path


def _collada_unit(path: Path) -> float:
    """Return the metres per unit of a COLLADA file; trimesh leaves its vertices as they are."""
    unit = etree.parse(str(path)).getroot().find('.//{*}asset/{*}unit')
    return float(unit.get('meter', 1.0)) if unit is not None else 1.0
