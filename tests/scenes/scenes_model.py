"""Bodies of drawn objects, and what they miss of them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from body_measures import WorldBody
from scene_table import Figures, Scene, scene

import servoid
from conftest import BACKGROUND, SIZE_PX, Drawing, write_png
from servoid.capture import open_capture
from servoid.model import ModelResult, Request, fit_capture
from servoid.segment import parse_target
from servoid.shape import BodyFile, load_body

MISSED = {"missed": "1"}


def drawn_figures(result: ModelResult, drawing: Drawing) -> Figures:
    """Say how far the ellipsoids of a drawing are from those that were modelled."""
    centers = result.body.world_from_object.transform(result.body.centers)
    away = []
    for drawn in drawing.ellipsoids:
        away.append(np.linalg.norm(centers - drawn.center, axis=1).min())
    return {
        "missed": 1.0 - float(result.iou_used.min()),
        "centre off": 1e3 * float(max(away)),
    }


@scene("model drawn", {**MISSED, "centre off": "mm"})
def model_drawn(seed: int, folder: Path) -> Figures:
    drawing = Drawing()
    views = open_capture(drawing.write(folder / "photos")).views()
    return drawn_figures(servoid.model.fit(views, max_ellipsoids=2, delta=0.0, seed=seed), drawing)


def without_masks(folder: Path) -> Path:
    """Delete a capture's masks, and what its capture.toml says of them."""
    for path in (folder / "masks").iterdir():
        path.unlink()
    toml = folder / "capture.toml"
    toml.write_text(re.sub(r"masks = .*\n", "", toml.read_text()))
    return folder


def box_around(drawing: Drawing, index: int) -> str:
    """Write the box around the object, 3 pixels larger than it on each side."""
    rows, columns = np.nonzero(drawing.mask(drawing.world_from_cameras()[index]))
    corners = (columns.min() - 3, rows.min() - 3, columns.max() + 3, rows.max() + 3)
    return "box:" + ",".join(map(str, corners))


def of_one_color() -> Drawing:
    one, other = Drawing().ellipsoids
    return Drawing((one, replace(other, color=one.color)))


def click_on(drawing: Drawing) -> str:
    """Write the click on the middle of the first ellipsoid, in the first view."""
    pose = np.linalg.inv(drawing.world_from_cameras()[0])
    x, y, z = pose[:3, :3] @ drawing.ellipsoids[0].center + pose[:3, 3]
    return f"click:{79.5 + 210 * x / z:.0f},{59.5 + 210 * y / z:.0f}"


def picture_target(kind: str, drawing: Drawing, folder: Path) -> str:
    """Write a picture for one view: its mask, or the background alone."""
    empty = np.full((*SIZE_PX[::-1], 3), BACKGROUND, np.uint8)
    pictures = {"mask": drawing.mask(drawing.world_from_cameras()[5]), "background": empty}
    write_png(folder / "mine.png", pictures[kind])
    return f"{kind}:{folder / 'mine.png'}@eye/0005"


def outline_figures(file: BodyFile, drawing: Drawing) -> Figures:
    """Say how much of the true outlines is missed, in the mean and at worst."""
    ious = WorldBody.of(file).ious(drawing)
    return {"missed": 1.0 - float(ious.mean()), "missed at most": 1.0 - float(ious.min())}


def target_of(kind: str, drawing: Drawing, folder: Path) -> str:
    match kind:
        case "box":
            return f"{box_around(drawing, 3)}@eye/0003"
        case "hue":
            return "hue:215..20"
        case "click":
            return click_on(drawing)
        case _:
            return picture_target(kind, drawing, folder)


def _targeted(kind: str) -> Scene:
    drawing = of_one_color() if kind == "click" else Drawing()

    @scene(f"model by {kind}", {**MISSED, "missed at most": "1"})
    def targeted(seed: int, folder: Path) -> Figures:
        capture = open_capture(without_masks(drawing.write(folder / "photos")))
        target = parse_target(target_of(kind, drawing, folder))
        request = Request(max_ellipsoids=3, delta=0.0, seed=seed)
        fit_capture(capture, request, targets=[target]).save(folder / "body.json")
        return outline_figures(load_body(folder / "body.json"), drawing)

    return targeted


BY_TARGET = {kind: _targeted(kind) for kind in ("box", "hue", "click", "mask", "background")}
