"""JSON values as what dataclasses declare: nothing more, nothing less, no number that is not finite."""

import math
import types
from dataclasses import fields, is_dataclass
from typing import get_args, get_origin, get_type_hints


def typed(kind, value, name: str):
    """A JSON value as `kind`: a dataclass, tuple[T, ...], tuple of a fixed length, dict[str, T], T | None, `dict` or `object` (as it is), str, bool, int or float.
    ValueError names the field that is something else; `name` is what the whole is called."""
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        if not isinstance(value, dict) or value.keys() != hints.keys():
            raise ValueError(f"{name} has other fields than {', '.join(hints)}")
        return kind(**{f.name: typed(hints[f.name], value[f.name], f"{name}.{f.name}") for f in fields(kind)})
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is types.UnionType:
        return None if value is None else typed(arguments[0], value, name)
    if origin is tuple:
        if not isinstance(value, list):
            raise ValueError(f"{name} is no list")
        if arguments[-1] is not Ellipsis and len(value) != len(arguments):
            raise ValueError(f"{name} has {len(value)} items instead of {len(arguments)}")
        return tuple(typed(arguments[0], item, f"{name}[{k}]") for k, item in enumerate(value))
    if origin is dict or kind is dict:
        if not isinstance(value, dict):
            raise ValueError(f"{name} is no table")
        return value if kind is dict else {key: typed(arguments[1], item, f"{name}[{key[:60]!r}]") for key, item in value.items()}
    allowed = (int, float) if kind is float else (kind,)
    try:
        if type(value) not in allowed or (kind is float and not math.isfinite(value)):
            raise ValueError(f"{name} is no {_WORDS.get(kind, kind.__name__)}")
        return kind(value)
    except OverflowError as error:
        raise ValueError(f"{name} is no {_WORDS[kind]}") from error


_WORDS = {str: "text", int: "whole number", float: "finite number", bool: "switch"}
