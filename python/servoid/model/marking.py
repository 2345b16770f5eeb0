"""Marks the object in a capture: chooses the views, and finds what the targets mean in them."""

from collections.abc import Sequence
from dataclasses import dataclass

from servoid.capture import Capture, CaptureView, shrunk
from servoid.errors import TargetError
from servoid.segment import Depth, HueTarget, Target, seek_object, undoubted
from servoid.words import counted


@dataclass(frozen=True)
class Marked:
    """The views of a capture that may be used: those that say where the object is, and others.

    `from_targets` says if a target marked the first ones, and not the capture's own masks; `notes`
    are what a person should know of what they found.
    """

    views: tuple[CaptureView, ...]
    others: tuple[CaptureView, ...]
    from_targets: bool
    notes: tuple[str, ...] = ()


def mark(
    capture: Capture,
    targets: Sequence[Target] = (),
    observations: slice | None = None,
    *,
    trusted: bool = False,
) -> Marked:
    """Find the object in a capture: by targets, or else by the capture's masks.

    Targets are in the pixels of the images as they were recorded, with the lens's distortion. With
    `trusted` a target that may mean several objects is used all the same, and a note says so.
    Without `observations` all are used, except in a recording, where the object may move: there it
    is the one that shows where the object is. A target that names no view is meant for the first
    one, a hue window for all.

    Raises:
        DoubtError: a target may mean several objects.
        TargetError: nothing says where the object is, a target names no view, or finds nothing.
        ImageError, MaskError: a file cannot be used.

    """
    views = _chosen(capture, targets, observations)
    marked: dict[str, CaptureView] = {}
    notes: list[str] = []
    for target in targets:
        for view in _meant(target, views):
            try:
                marked[view.name] = _found(target, view, notes, trusted=trusted)
            except TargetError:
                # A hue window may hold nothing in some of the views, but not in all.
                if not isinstance(target, HueTarget) or target.view is not None:
                    raise
    if targets and not marked:
        raise TargetError(
            f"'{targets[0]}' finds the object in none of {counted(len(views), 'view')}; choose "
            "a wider window, or mark the object with a box"
        )
    if not targets:
        marked = {view.name: view for view in views if view.has_mask}
    if not marked:
        raise TargetError(
            f"{capture.path}: no usable view: nothing says where the object is; give at least one "
            f"image a mask, or mark the object in one, such as {_example(views)}"
        )
    kept = [marked.get(view.name, view) for view in views]
    small, note = shrunk(kept)
    return Marked(
        views=tuple(view for view in small if view.name in marked),
        others=tuple(view for view in small if view.name not in marked),
        from_targets=bool(targets),
        notes=(*notes, *([] if note is None else [note])),
    )


def _found(target: Target, view: CaptureView, notes: list[str], *, trusted: bool) -> CaptureView:
    """Return a view with the mask that a target means in it, as it was recorded."""
    image, metres = view.recorded_image(), view.recorded_depth()
    depth = None if metres is None else Depth(metres, view.lens.focal_px[0])
    found = seek_object(target, image, depth)
    if not trusted:
        undoubted(found, target, image)
    elif found.doubt is not None:
        notes.append(f"the target '{target}' was trusted, although {found.doubt}")
    notes.extend(f"the target '{target}': {note}" for note in found.notes)
    return view.with_recorded_mask(found.mask)


def _chosen(
    capture: Capture, targets: Sequence[Target], observations: slice | None
) -> list[CaptureView]:
    views = capture.all_views()
    if observations is not None:
        kept = set(range(len(capture))[observations])
        if not kept:
            raise TargetError(
                f"{capture.path}: the range of observations holds none of the {len(capture)}; "
                f"choose among 0 to {len(capture) - 1}"
            )
        return [view for view in views if view.index in kept]
    if not capture.is_recording:
        return views
    named = [target.view for target in targets if target.view is not None]
    for view in views:
        if view.name in named or (not named and (bool(targets) or view.has_mask)):
            return [other for other in views if other.index == view.index]
    return views


def _meant(target: Target, views: Sequence[CaptureView]) -> list[CaptureView]:
    if target.view is None:
        return list(views) if isinstance(target, HueTarget) else list(views[:1])
    meant = [view for view in views if view.name == target.view]
    if not meant:
        names = [view.name for view in views]
        some = ", ".join(names if len(names) <= 4 else [*names[:3], "...", names[-1]])
        raise TargetError(f"'{target}' names no view; the views are {some}")
    return meant


def _example(views: Sequence[CaptureView]) -> str:
    at = f"@{views[0].name}" if views else ""
    return f"--target box:120,80,420,400{at}"
