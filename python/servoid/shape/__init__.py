"""Bodies: rigid sets of ellipsoids, and their files."""

from servoid._native import Body
from servoid.shape.bodies import NO_UNIT, body_sides, body_size_note, placed
from servoid.shape.body_file import (
    BodyFile,
    EllipsoidEntry,
    MadeBy,
    SeenEntry,
    body_schema,
    load_body,
    published_schema,
    save_body,
    write_body_file,
)

__all__ = [
    "Body",
    "BodyFile",
    "EllipsoidEntry",
    "MadeBy",
    "SeenEntry",
    "body_schema",
    "load_body",
    "published_schema",
    "save_body",
    "write_body_file",
]
