"""Builds a MuJoCo model of visuals, each of which is a body that can have any pose."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from servoid.pose import Floats, exact
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.meshes import as_mesh
from servoid.sim.world.scene.visuals import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Finish,
    MeshShape,
    Plane,
    Shape,
    Visual,
)


def build_model(visuals: Sequence[Visual]) -> Any:
    """Return a `mujoco.MjModel` in which visual number i is mocap body and geom number i."""
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    spec.visual.quality.shadowsize = 0
    spec.visual.quality.offsamples = 0
    spec.visual.headlight.active = 0
    spec.visual.rgba.haze = [0.0] * 4
    spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=False)
    for index, visual in enumerate(visuals):
        body = spec.worldbody.add_body(name=f"visual {index}", mocap=True)
        geom = body.add_geom(contype=0, conaffinity=0, mass=0.0)
        _shape(spec, geom, visual.shape, index, textured=visual.finish.texture is not None)
        geom.material = _material(spec, visual.finish, index)
    return spec.compile()


def _shape(spec: Any, geom: Any, shape: Shape, index: int, textured: bool) -> None:
    kinds = load_mujoco().mjtGeom
    mesh = shape if isinstance(shape, MeshShape) else None
    if mesh is None and (textured or isinstance(shape, Plane)):
        mesh = _with_texture(shape)
    match shape:
        case _ if mesh is not None:
            geom.type, geom.meshname = kinds.mjGEOM_MESH, _add_mesh(spec, mesh, index)
        case Ellipsoid(radii):
            geom.type, geom.size = kinds.mjGEOM_ELLIPSOID, list(radii)
        case Capsule(radius, half):
            geom.type, geom.size = kinds.mjGEOM_CAPSULE, [radius, half, 0.0]
        case Cylinder(radius, half):
            geom.type, geom.size = kinds.mjGEOM_CYLINDER, [radius, half, 0.0]
        case Box(half_size):
            geom.type, geom.size = kinds.mjGEOM_BOX, list(half_size)


def _add_mesh(spec: Any, mesh: MeshShape, index: int) -> str:
    name = f"mesh {index}"
    added = spec.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel().tolist(),
        userface=mesh.faces.ravel().tolist(),
        # A sheet or a mesh with doubled seams has no volume for an inertia.
        inertia=load_mujoco().mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    if mesh.texture_coordinates is not None:
        added.usertexcoord = mesh.texture_coordinates.ravel().tolist()
        added.userfacetexcoord = mesh.faces.ravel().tolist()
    return name


def _material(spec: Any, finish: Finish, index: int) -> str:
    mujoco = load_mujoco()
    name = f"finish {index}"
    material = spec.add_material(
        name=name,
        rgba=[*finish.color, 1.0],
        specular=finish.gloss,
        shininess=0.6,
        texrepeat=list(finish.repeat),
    )
    if finish.texture is not None:
        height, width, channels = finish.texture.shape
        texture = spec.add_texture(
            name=f"texture {index}",
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=width,
            height=height,
            nchannel=channels,
        )
        texture.data = finish.texture.tobytes()
        textures = list(material.textures)
        textures[mujoco.mjtTextureRole.mjTEXROLE_RGB.value] = f"texture {index}"
        material.textures = textures
    return name


def _with_texture(shape: Shape) -> MeshShape:
    """Return a shape as triangles with the ray-caster's texture coordinates."""
    if isinstance(shape, Plane):
        x, y = shape.half_size
        return _quads([_quad((0.0, 0.0, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0))])
    if isinstance(shape, Box):
        x, y, z = shape.half_size
        return _quads(
            [
                _quad((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)),
                _quad((-x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)),
                _quad((0.0, y, 0.0), (x, 0.0, 0.0), (0.0, 0.0, z)),
                _quad((0.0, -y, 0.0), (x, 0.0, 0.0), (0.0, 0.0, z)),
                _quad((0.0, 0.0, z), (x, 0.0, 0.0), (0.0, y, 0.0)),
                _quad((0.0, 0.0, -z), (x, 0.0, 0.0), (0.0, y, 0.0)),
            ]
        )
    mesh = as_mesh(shape)
    if mesh.texture_coordinates is None:
        return mesh
    turned = mesh.texture_coordinates + np.array(
        [0.5, 0.0]
    )  # the ray-caster's texture begins at -x
    return MeshShape(mesh.vertices, mesh.faces, turned)


def _quad(middle: tuple[float, ...], right: tuple[float, ...], up: tuple[float, ...]) -> Floats:
    """Return the corners (4, 3) of a rectangle, from the lower left one on.

    They are in anticlockwise order, seen from the direction of `middle`, or from above.
    """
    m, r, u = np.array(middle), np.array(right), np.array(up)
    return np.array([m - r - u, m + r - u, m + r + u, m - r + u])


def _quads(corners: list[Floats]) -> MeshShape:
    vertices = np.concatenate(corners)
    faces = []
    for index, quad in enumerate(corners):
        across = np.cross(quad[1] - quad[0], quad[3] - quad[0])
        middle = quad.mean(axis=0)
        a, b, c, d = 4 * index + np.arange(4)
        turned = exact.dot(across, middle) < 0.0
        faces += [[a, c, b], [a, d, c]] if turned else [[a, b, c], [a, c, d]]
    coordinates = np.tile([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], (len(corners), 1))
    return MeshShape(vertices, np.array(faces, np.int64), coordinates)
