"""A body for MuJoCo: one free body with native ellipsoids."""

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from servoid.errors import ExportError
from servoid.exchange.export.solid import Solid
from servoid.exchange.export.xml_text import document, numbers

# The limits below which MuJoCo rejects mass and inertia.
LEAST_MASS_KG = 1e-15
LEAST_INERTIA = 1e-14


def mjcf_text(solid: Solid) -> bytes:
    """Return an MJCF model. The inertia is the union's: overlaps of ellipsoids count once.

    Raises:
        ExportError: the body is too light for MuJoCo.

    """
    least = float(np.linalg.eigvalsh(solid.inertia)[0])
    if solid.mass_kg < LEAST_MASS_KG or least < LEAST_INERTIA:
        raise ExportError(
            f"MuJoCo rejects a body of {solid.mass_kg:.3g} kg and an inertia of {least:.3g} kg m²; "
            f"the minimum is {LEAST_MASS_KG:g} kg and {LEAST_INERTIA:g} kg m²: give a higher "
            "density, or lengths in metres"
        )
    root = Element("mujoco", model=solid.name)
    world = SubElement(root, "worldbody")
    pose = solid.frame_from_link
    body = SubElement(
        world,
        "body",
        name=solid.name,
        pos=numbers(pose.translation),
        quat=numbers(pose.quaternion),
    )
    SubElement(body, "freejoint", name=f"{solid.name}_free")
    inertia = solid.inertia
    upper = [
        inertia[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    ]
    SubElement(
        body,
        "inertial",
        pos=numbers(solid.centroid),
        mass=numbers([solid.mass_kg]),
        fullinertia=numbers(upper),
    )
    for index, piece in enumerate(solid.pieces):
        SubElement(
            body,
            "geom",
            name=f"{solid.name}_ellipsoid_{index}",
            type="ellipsoid",
            size=numbers(piece.radii),
            pos=numbers(piece.pose.translation),
            quat=numbers(piece.pose.quaternion),
            rgba=numbers([*piece.rgb, 1.0]),
        )
    return document(root)
