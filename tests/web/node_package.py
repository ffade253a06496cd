"""tools/exports/node_package.py for tests: what cannot be had is skipped loudly, with the reason."""

import functools

import pytest

from tools.exports import node_package
from tools.exports.node_package import PACKAGE, Failed  # noqa: F401


def _or_skipped(call):
    @functools.wraps(call)
    def had(*arguments, **named):
        try:
            return call(*arguments, **named)
        except node_package.Missing as missing:
            pytest.skip(f"SKIPPED: {missing}")

    return had


node, need_packages, chromium, drawn = map(_or_skipped, (node_package.node, node_package.need_packages, node_package.chromium, node_package.drawn))
