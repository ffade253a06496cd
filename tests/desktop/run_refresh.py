"""Runs inside a real Blender window: a thing is moved, and what is old is baked again by itself: not at all, when idle, stopped by the next change, at once;
see artist.py. The sample is contact.blend or one like it: a reflector and a thing close to it."""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from artist import PATIENCE, arrange, bake, install, part, picture, results, run, scene, set_small, state  # noqa: E402

MOVED = sys.argv[-1]  # name of the object that moves


def move(by):
    scene().objects[MOVED].location.z += by
    yield 1.0
    assert state().stale, "the window's timer read the change"


def until(what, wanted):
    """Waits for it; how long that took goes into the results."""
    start = time.monotonic()
    while not wanted():
        yield 0.1
        if time.monotonic() - start > PATIENCE:
            raise TimeoutError(what)
    results["seconds"][what] = round(time.monotonic() - start, 2)


def running():
    return part("ops.bake").running()


def story():
    install()
    yield 2.0
    yield from arrange()
    set_small()
    settings = scene().reflect
    settings.method = "environment"
    yield from bake()
    assert not (state().stale or state().compared.missing)

    yield from move(0.1)
    picture("01-old")
    results["said"] = [one.sentence() for one in state().compared.refreshes.values()]
    assert all(f"{MOVED} was moved; about " in said for said in results["said"])
    yield 7.0
    assert state().stale and running() is None, "by hand"

    settings.refresh = "IDLE"
    yield from until("idle: begun", lambda: running() is not None)
    picture("02-begun")
    scene().camera.location.x += 0.01
    yield 0.5
    assert running() is not None, "a camera stops nothing"
    yield from move(0.1)
    yield from until("idle: stopped by a change", lambda: running() is None)
    assert state().stale
    yield from until("idle: fresh", lambda: not state().stale)
    assert results["seconds"]["idle: fresh"] > 3.0, "five seconds without a change"
    picture("03-fresh")
    yield 7.0
    assert running() is None, "nothing is left to do"

    settings.refresh, settings.refresh_seconds = "LIVE", 0.0
    yield from move(-0.1)
    yield 3.0
    assert state().stale and running() is None, "no budget"
    settings.refresh_seconds = 100.0
    yield from until("at once: fresh", lambda: not state().stale)
    scene().cycles.diffuse_bounces += 1
    yield from until("bounces: noticed", lambda: bool(state().stale))
    yield from until("bounces: fresh", lambda: not state().stale)
    assert not state().bake_error and not state().draw_error()
    picture("04-fresh")


run(story)
