"""What the settings of methods mean: the words, values and units from which checks and the panel's fields are made.

A method's DEFAULTS name its settings; the default's type is the setting's type. What a person needs to know besides is a
`Setting`: in COMMON for those that several methods have (a name means the same everywhere), in the method's own SETTINGS
for the rest. A setting without either still works and has a field, named by its name alone.
"""

from dataclasses import dataclass

from .errors import ReflectError
from .spaces import FAR

METRES = "m"


@dataclass(frozen=True)
class Setting:
    """How one setting is shown, and which values it may have besides those of its type."""

    label: str  # in the panel, Title Case
    tooltip: str  # a sentence or two without the last full stop
    low: float | None = None  # least and largest value; None: 1 to 999999 for whole numbers, 0 to FAR for others
    high: float | None = None
    soft_high: float | None = None  # where a slider ends
    unit: str = ""  # METRES or nothing
    power_of_two: bool = False  # the side of an image: 4 to 8192, and `high`, `low` what the panel offers of them
    advanced: bool = False  # in the panel below the others, folded away
    drawn: bool = False  # decides only what is drawn: another value needs no other bake (core/drawn_settings.py)
    in_window: bool | None = None  # the default in the window, where it is not the command line's

    def check(self, name: str, default: object, value: object) -> None:
        """ReflectError unless `value` is a possible one of the setting `name`, which has this default."""
        remedy = None
        if isinstance(default, bool):
            remedy = "Give true or false." if type(value) is not bool else None
        elif isinstance(default, int):
            low, high = self.whole()
            if type(value) is not int or not low <= value <= high:
                remedy = f"Give a whole number from {low} to {high}."
            elif self.power_of_two and (value & (value - 1) or not SIDES[0] <= value <= SIDES[1]):
                remedy = f"Give a power of two from {SIDES[0]} to {SIDES[1]}."
        elif isinstance(default, float):
            # NaN fails the comparison. FAR and more is no length.
            low, high = self.low or 0.0, FAR if self.high is None else self.high
            if type(value) not in (int, float) or not low <= value <= high or value >= FAR:
                remedy = f"Give a number from {low:g} on." if self.high is None else f"Give a number from {low:g} to {high:g}."
        elif isinstance(default, tuple):
            if not isinstance(value, tuple | list) or not all(type(v) is str for v in value):
                remedy = 'Give names of objects, ["A", "B"].'
        if remedy:
            raise ReflectError(f"The setting {name} cannot be {value!r}.", remedy)

    def whole(self) -> tuple[int, int]:
        """Least and largest value of a setting that is a whole number; sides of images are bounded by SIDES besides."""
        if self.power_of_two:
            return 1, LARGEST
        return int(self.low or 1), int(self.high or LARGEST)


LARGEST = 999999  # of a whole number
SIDES = (4, 8192)  # of an image: every graphics card holds the largest

COMMON = {
    "resolution": Setting(
        "Resolution",
        "Texels along an edge of the captured surroundings. Twice as many need four times the memory and bake time",
        low=16, high=4096, power_of_two=True,
    ),
    "texels": Setting(
        "Texels", "Most texels along an edge of the picture that stands for an object. Less is taken where no reflection "
        "is seen closely enough", low=16, high=1024, power_of_two=True,
    ),
    "samples": Setting(
        "Samples", "Cycles samples per texel of a bake. More samples give less noise and take longer", soft_high=1024
    ),
    "sky_error": Setting(
        "Sky Error", "Largest error, as a share of the radiance, of a map that sees nothing but the sky: there its resolution "
        "doubles until the error is smaller. 0: the resolution stays", soft_high=0.1, advanced=True,
    ),
    "live": Setting(
        "Follow Movement", "Reflections of objects follow while the objects move. Bakes what their surfaces send out too, "
        "which takes from a few to some ten seconds more", in_window=True,
    ),
    "view_dependent": Setting(
        "View Dependent", "Glossy objects show highlights of lamps where the reflected ray sees them, not where the bake saw "
        "them. Costs time where something glossy is reflected",
    ),
    "without": Setting("Without", "Names of objects that the reflector shows nothing of", advanced=True),
    "ground_size": Setting(
        "Ground Size", "Width of the box whose floor is a ground that goes on into the distance, centred on the reflector. "
        "0: chosen from the scene. A reflector that is wider has no such box", unit=METRES, soft_high=1000.0,
    ),
    "ground_morph": Setting(
        "Ground Morph", "Height of the band at the foot of the ground box's walls in which nearness fades into distance. "
        "0: the reflector's own height above the ground", unit=METRES, soft_high=100.0,
    ),
    "ground_height": Setting(
        "Ground Below", "Height of the reflector's centre above a ground that is only in the world's picture. "
        "0: the picture shows none", unit=METRES, soft_high=100.0,
    ),
}  # fmt: skip


def of(method, name: str) -> Setting:
    """The words and values of a method's setting: its own, the common ones, or made from the name."""
    plain = Setting(name.replace("_", " ").title(), f"The method's setting {name}, as on the command line", advanced=True)
    return getattr(method, "SETTINGS", {}).get(name) or COMMON.get(name) or plain
