"""Writes a body as URDF, which has no ellipsoids: meshes represent them."""

from xml.etree.ElementTree import Element, SubElement

from servoid.exchange.export.solid import Solid
from servoid.exchange.export.xml_text import document, numbers, pose_numbers


def urdf_text(solid: Solid, visual: str, ball: str) -> bytes:
    """Return a URDF robot of one link, in the coordinates of that link.

    `visual` is the file of the union's surface, `ball` that of a unit ball, which is scaled to each
    ellipsoid's radii for collision; both are beside the URDF file.
    """
    root = Element("robot", name=solid.name)
    link = SubElement(root, "link", name=solid.name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=numbers(solid.centroid), rpy="0 0 0")
    SubElement(inertial, "mass", value=numbers([solid.mass_kg]))
    entries = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    SubElement(
        inertial,
        "inertia",
        {f"i{'xyz'[i]}{'xyz'[j]}": numbers([solid.inertia[i, j]]) for i, j in entries},
    )
    # No material here: it would override the colours of the mesh.
    looks = SubElement(link, "visual", name=f"{solid.name}_surface")
    SubElement(SubElement(looks, "geometry"), "mesh", filename=visual)
    for index, piece in enumerate(solid.pieces):
        collision = SubElement(link, "collision", name=f"{solid.name}_ellipsoid_{index}")
        xyz, rpy = pose_numbers(piece.pose.matrix())
        SubElement(collision, "origin", xyz=xyz, rpy=rpy)
        geometry = SubElement(collision, "geometry")
        SubElement(geometry, "mesh", filename=ball, scale=numbers(piece.radii))
    return document(root)
