"""A body for MuJoCo: one free body with native ellipsoids."""

from xml.etree.ElementTree import Element, SubElement

from servoid.exchange.export.solid import Solid
from servoid.exchange.export.xml_text import document, numbers


def mjcf_text(solid: Solid) -> bytes:
    """Return an MJCF model. The inertia is the union's: what two ellipsoids hold weighs once."""
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
