"""A body for Gazebo and other readers of SDFormat: one link with native ellipsoids."""

from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from servoid.exchange.export.solid import Piece, Solid
from servoid.exchange.export.xml_text import document, numbers, pose_numbers

VERSION = "1.8"  # the first version with ellipsoids


def sdf_text(solid: Solid) -> bytes:
    """Return an SDFormat model; poses are x y z and roll pitch yaw."""
    root = Element("sdf", version=VERSION)
    model = SubElement(root, "model", name=solid.name)
    _pose(model, solid.frame_from_link.matrix())
    link = SubElement(model, "link", name="link")
    inertial = SubElement(link, "inertial")
    at_centroid = np.eye(4)
    at_centroid[:3, 3] = solid.centroid
    _pose(inertial, at_centroid)
    SubElement(inertial, "mass").text = numbers([solid.mass_kg])
    inertia = SubElement(inertial, "inertia")
    for row, column in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        entry = SubElement(inertia, f"i{'xyz'[row]}{'xyz'[column]}")
        entry.text = numbers([solid.inertia[row, column]])
    for index, piece in enumerate(solid.pieces):
        _shape(SubElement(link, "collision", name=f"collision_{index}"), piece)
        visual = SubElement(link, "visual", name=f"visual_{index}")
        _shape(visual, piece)
        material = SubElement(visual, "material")
        for light in ("ambient", "diffuse"):
            SubElement(material, light).text = numbers([*piece.rgb, 1.0])
    return document(root)


def _shape(parent: Element, piece: Piece) -> None:
    _pose(parent, piece.pose.matrix())
    ellipsoid = SubElement(SubElement(parent, "geometry"), "ellipsoid")
    SubElement(ellipsoid, "radii").text = numbers(piece.radii)


def _pose(parent: Element, matrix: NDArray[np.float64]) -> None:
    SubElement(parent, "pose").text = " ".join(pose_numbers(matrix))
