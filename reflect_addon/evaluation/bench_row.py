"""One line of targets.json, as the bench's modules make it."""


def row(name: str, ours, target, holds: bool, how: str, paper=None) -> dict:
    """ours, target, paper: numbers or lists of numbers (bench.Target)."""

    def plain(value):
        return None if value is None else [float(v) for v in value] if isinstance(value, list | tuple) else float(value)

    return {"id": name, "paper": plain(paper), "ours": plain(ours), "target": plain(target), "holds": bool(holds), "how": how}
