//! Law of the tracker's memory; alone in its file, since it counts allocations.

#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a test that cannot go on has failed; what it expects may come from any library"
)]

#[path = "laws/shapes/mod.rs"]
mod shapes;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nalgebra::{UnitQuaternion, Vector3};
use servoid::pose::Pose;
use servoid::track::{Status, TrackSettings, Tracker};
use shapes::drawn::{Stage, eyes};

/// Counts the allocations of a thread while counting is enabled.
struct Counting;

thread_local! {
    static COUNTS: Cell<bool> = const { Cell::new(false) };
    static TAKEN: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

fn note(size: usize) {
    if COUNTS.get() {
        let (times, bytes) = TAKEN.get();
        TAKEN.set((times + 1, bytes + size));
    }
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller fulfils the contract of `alloc`, which is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: all memory that is freed here came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Pose of an object that swings to and fro.
fn swinging(index: usize) -> Pose {
    let share = (0.4 * index as f64).sin();
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.4 + 0.05 * share, 0.2);
    Pose::from_rotation(turn, Vector3::new(0.01 * share, -0.01, 0.05))
}

#[test]
fn a_step_takes_no_memory_once_all_sides_in_view_are_known() {
    let stage = Stage::textured();
    let mut tracker =
        Tracker::new(&stage.cameras(), &stage.body, TrackSettings::default()).unwrap();
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&swinging(index)));
    tracker.start(&shot(0).observation(), swinging(0), &[]).unwrap();
    for index in 1..40 {
        let shot = shot(index);
        let observation = shot.observation();
        TAKEN.set((0, 0));
        COUNTS.set(true);
        let found = tracker.step(&observation);
        COUNTS.set(false);
        let found = found.unwrap();
        assert_eq!(found.status, Status::Tracking);
        assert!(found.notices.is_empty(), "{:?}", found.notices);
        assert!(index < 15 || TAKEN.get() == (0, 0), "image {index}: {:?}", TAKEN.get());
    }
}
