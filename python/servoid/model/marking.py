"""Marks the object in a capture: selects the views, and finds the objects that targets mean."""

from collections.abc import Sequence
from dataclasses import dataclass

from servoid.capture import Capture, CaptureView, shrunk
from servoid.errors import TargetError
from servoid.model.border_agreement import border_notes
from servoid.model.finding import find_in_view
from servoid.model.grey_masks import grey_mask_notes
from servoid.segment import HueTarget, MaskTarget, Target, undoubted
from servoid.words import counted


@dataclass(frozen=True)
class Marked:
    """The usable views of a capture: those with a mask, and the others.

    `from_targets` is true if targets marked the first ones, and not the capture's own masks;
    `notes` are messages for the user, and `doubts` others that doubt the masks.
    """

    views: tuple[CaptureView, ...]
    others: tuple[CaptureView, ...]
    from_targets: bool
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def mark(
    capture: Capture,
    targets: Sequence[Target] = (),
    observations: slice | None = None,
    *,
    trusted: bool = False,
) -> Marked:
    """Find the object in a capture by targets, or without targets by the capture's masks.

    Targets are in the pixels of the recorded images, with the lens's distortion. With `trusted`, an
    ambiguous target is used anyway, and a note reports it. Without `observations`, all are used,
    except in a recording, where the object may move: there, the one in which the object is marked.
    A target that names no view applies to the first one, a hue window to all.

    Raises:
        DoubtError: a target is ambiguous.
        TargetError: nothing marks the object, a target names no view, or finds nothing.
        ImageError, MaskError: a file cannot be used.

    """
    views = _chosen(capture, targets, observations)
    marked: dict[str, CaptureView] = {}
    doubts: list[str] = []
    for target in targets:
        for view in views_meant(target, views):
            try:
                marked[view.name] = _found(target, view, views, doubts, trusted=trusted)
            except TargetError:
                # A hue window may match nothing in some of the views, but not in all.
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
            f"{capture.path}: no usable view: nothing marks the object; give at least one "
            f"image a mask, or mark the object in one, such as {_example(views)}"
        )
    kept = [marked.get(view.name, view) for view in views]
    small, note = shrunk(kept)
    found = tuple(view for view in small if view.name in marked)
    if not trusted and all(isinstance(target, MaskTarget) for target in targets):
        doubts.extend(grey_mask_notes(list(marked.values())))
        doubts.extend(border_notes(found))  # other targets were looked for in the images
    replaced = sum(view.has_mask for view in views) if targets else 0
    return Marked(
        views=found,
        others=tuple(view for view in small if view.name not in marked),
        from_targets=bool(targets),
        notes=(*([] if note is None else [note]), *([_instead_of(replaced)] if replaced else [])),
        doubts=tuple(doubts),
    )


def _instead_of(count: int) -> str:
    """Report the capture's own masks, which targets replace."""
    return (
        f"--target marks the object instead of the capture's own {counted(count, 'mask')}; leave "
        "it out to use these"
    )


def _found(
    target: Target,
    view: CaptureView,
    views: Sequence[CaptureView],
    doubts: list[str],
    *,
    trusted: bool,
) -> CaptureView:
    """Return a view with the mask that a target finds; what is doubtful is added to `doubts`."""
    image = view.recorded_image()
    found = find_in_view(target, view, image, views)
    if not trusted:
        undoubted(found, target, image)
    elif found.doubt is not None:
        doubts.append(f"the target '{target}' was trusted, although {found.doubt}")
    doubts.extend(f"the target '{target}': {note}" for note in found.notes)
    return view.with_recorded_mask(found.mask)


def _chosen(
    capture: Capture, targets: Sequence[Target], observations: slice | None
) -> list[CaptureView]:
    views = capture.all_views()
    if observations is not None:
        kept = set(range(len(capture))[observations])
        if not kept:
            raise TargetError(
                f"{capture.path}: the range of observations selects none of the {len(capture)}; "
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


def views_meant(target: Target, views: Sequence[CaptureView]) -> list[CaptureView]:
    """List the views to which a target applies: the one that it names, or the first; a hue to all.

    Raises:
        TargetError: it names none of them.

    """
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
