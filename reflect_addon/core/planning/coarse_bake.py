"""The bake of a try: the settings that make it cheap and keep its points, and what its images are at full size."""

from ..asset import Asset
from ..asset_images import kind_of

# Times fewer texels a side: of a try, of the second one that tells what the full ones will bring, and of one that decides between stand-ins that are nearly as good.
COARSER, COARSEST, FINER = 4, 8, 2
LEAST, LEAST_OF_ALL = 16, 8  # texels a side, of such tries
SIDES = ("resolution", "texels", "view_texels")
# What a try leaves out: what needs light, and what finds more of it.
PLAIN = {"samples": 1, "sky_error": 0.0, "live": False, "view_dependent": False}
# Images that grow with the side of what was baked, or not at all, and not with its square.
GROWTH = {"billboard_buf": 0, "srdm_buf": 1, "srdm_tx": 1}


def coarse(asked: dict[str, object], coarser: int = COARSER) -> dict[str, object]:
    """The settings of a try."""
    least = LEAST if coarser <= COARSER else LEAST_OF_ALL
    sides = {name: max(int(asked[name]) // coarser, min(least, int(asked[name]))) for name in SIDES if name in asked}
    return {**asked, **sides, **{name: value for name, value in PLAIN.items() if name in asked}}


def finer(asked: dict[str, object], coarser: int = COARSER) -> float:
    """How many times as many texels a side the real bake has as a try, in the images that gain least."""
    used = coarse(asked, coarser)
    return min((int(asked[name]) / used[name] for name in SIDES if name in asked), default=1.0)


def grown(asset: Asset, coarser: int) -> int:
    """Bytes of what a coarse asset is at its full size."""
    return sum(
        image.shape[0] * image.shape[1] * kind_of(name).bytes * coarser ** GROWTH.get(name, 2) for name, image in asset.images.items()
    )
