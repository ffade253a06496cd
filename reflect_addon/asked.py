"""What a command asked for, read the same way by all verbs, and how a verb answers."""

import json
import sys
from collections.abc import Callable

from .core import methods as registry
from .core.errors import ReflectError

EEVEE = "eevee"  # evaluation/peer.py; named here so that reading a command loads no evaluation


def methods_of(text: str, peers: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Names of methods in a list, each once; `all` stands for every method, but for no peer."""
    names = []
    for name in (n.strip() for n in text.split(",") if n.strip()):
        names += registry.names() if name == "all" else [name]
    if not names:
        raise ReflectError("No method was named.", f"Choose among: {', '.join(registry.names())}.")
    for name in names:
        if name == EEVEE and name not in peers:
            raise ReflectError(
                "eevee is EEVEE's own picture, to compare methods with: only evaluate makes it, and there is nothing to bake.",
                f"Choose among: {', '.join(registry.names())}.",
            )
        if name not in peers:
            registry.get(name)
    return tuple(dict.fromkeys(names))


def settings_of(arguments, wanted: tuple[str, ...]) -> dict[str, object]:
    """Settings of the bake that were asked for, checked; `evaluate --samples` are the truth's and not among them."""
    given = dict(arguments.set)
    if arguments.resolution:
        given["resolution"] = arguments.resolution
    if arguments.verb in ("analyse", "bake") and arguments.samples:
        given["samples"] = arguments.samples
    registry.check_settings(tuple(n for n in wanted if n != EEVEE), dict(arguments.set))
    return given


def progress(arguments) -> Callable[[float, str], bool]:
    """Progress as lines on standard error, each once: who waits for something repeats itself. False asks the work to end:
    see cli.Interruption."""
    last = ""

    def say(share: float, text: str) -> bool:
        nonlocal last
        line = f"reflect: {share * 100:3.0f} % {text}"
        if line != last:
            print(line, file=sys.stderr, flush=True)
        last = line
        return not arguments.interruption.came

    return say


def json_progress(arguments) -> Callable[[float, str], bool]:
    """The same as JSON on standard output, for the process that started this one."""

    def say(share: float, text: str) -> bool:
        answer(arguments, json.dumps({"progress": round(share, 4), "message": text}))
        return not arguments.interruption.came

    return say


def answer(arguments, result) -> None:
    """To standard output, which cli.py keeps free of everything else."""
    print(result, file=arguments.results, flush=True)
