"""kernel/bounds.py: a count's range holds every count that rays have; kernel/regions.py: equal code has one key."""

import math

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.kernel.bounds import range_of
from reflect_addon.core.kernel.regions import Outline
from reflect_addon.core.kernel.schedule import schedule


def test_a_range_holds_what_rays_have(rng):
    def kernel(k, scope, a, b):
        n = scope.uniforms["n"]
        begin = k.clamp(a, 0.0, n - 1.0)
        return {
            "chosen": k.select(a > 0.0, 16.0, 0.0), "left": n - begin, "product": k.min(k.max(b, -2.0), 3.0) * -n,
            "floor": k.floor(k.clamp(b, -1.5, 2.5)), "turned": -k.max(k.min(a, 4.0), -n), "open": k.max(a, 1.0), "unknown": a * b,
        }  # fmt: skip

    asset = Asset("a", "", {}, {"n": 8.0})
    program = record_function(kernel, {"a": "float", "b": "float"}, uniforms=asset.uniforms)
    found = evaluate(program, {"a": rng.normal(0, 9, 4000), "b": rng.normal(0, 9, 4000)}, asset)
    ranges = {name: range_of(node, lambda node: asset.uniforms[node.data]) for name, node in program.outputs.items()}
    for name, (least, most) in ranges.items():
        assert least <= found[name].min() and found[name].max() <= most, name
    assert [ranges[n] for n in ("chosen", "left", "product", "floor", "turned")] == [(0, 16), (1, 8), (-24, 16), (-2, 2), (-4, 8)]
    assert ranges["open"] == (1.0, math.inf) and ranges["unknown"] == (-math.inf, math.inf)


def outlines(kernel, **options):
    """The outlines of the bodies of a kernel's loops."""
    program = record_function(kernel, {"a": "float", "b": "float"}, options=options)
    plan = schedule(program)
    loops = [n for n in plan.blocks[program.graph.root] if n.op == "loop"]
    return [Outline(plan, n.data.body, n.data.body.results, lambda count: None) for n in loops]


def test_equal_regions_have_one_key_and_others_have_not():
    def kernel(k, scope, a, b):
        def walk(of, step):
            return k.loop(4, (of,), lambda i, x: ((k.branch(x > a, lambda: (x * step,), lambda: (x + b,))[0],), None))[0]

        return {"x": walk(a, 2.0) + walk(b, 2.0) + walk(b, 3.0)}

    one, same, other = outlines(kernel)
    assert one.key == same.key != other.key
    assert [n.data for n in one.reads if n.op == "input"] == ["a", "b"]
    assert len(one.gives) == 1 and not one.passes and one.loops == 0


def test_what_is_read_twice_is_not_two_values():
    """x * x and x * y differ, though each reads what comes from outside."""

    def kernel(k, scope, a, b):
        def scaled(p, q):
            return k.loop(3, (1.0,), lambda i, x: ((x * p + x * q,), None))[0]

        return {"x": scaled(a, a) + scaled(a, b)}

    one, two = outlines(kernel)
    assert one.key != two.key
