"""What evaluate asks of EEVEE, as plain values that cross into the process that draws (eevee_draw.py)."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Probe:
    """Where a light probe stands, in metres, world. kind: 'SPHERE' (parallax of a sphere that holds the scene), 'BOX' (a sphere probe whose
    parallax is the room's box) or 'PLANE'."""

    kind: str
    centre: tuple[float, float, float]
    influence: float  # radius that holds what it acts on; of a plane the distance before it
    reach: float  # radius that holds the scene
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))  # rows: its x, y, z; a plane's z is its normal
    half: tuple[float, float, float] = (1.0, 1.0, 1.0)  # of a box along its axes, of a plane along x and y


@dataclass(frozen=True)
class Groups:
    """A method of ours as node groups: its name and the folder of its assets."""

    method: str
    folder: str


@dataclass(frozen=True)
class Job:
    """Everything that the pictures depend on beside the file."""

    scene: str
    camera: str
    frame: int
    size: tuple[int, int]
    samples: int
    probe_side: int  # texels of a probe's cube face, a power of two
    materials: tuple[str, ...]  # the shiny ones
    marked: tuple[str, ...]  # objects that reflect all over although no material of theirs is shiny
    hidden: tuple[str, ...]  # objects that sphere probes do not see
    probes: tuple[Probe, ...]
    settings: tuple[dict, ...]  # EEVEE's own pictures: {"screen_tracing": bool, "sphere_probe": bool, "box_probe": bool, "plane_probe": bool}
    groups: tuple[Groups, ...] = ()  # our pictures
    diagonal: float = 1.0  # of the scene, m: distances of our groups are told in it
    shown: bool = False  # our pictures are for the eye, not to be judged ray by ray
    volume: bool = False  # EEVEE's own pictures have a volume probe over the scene
    timed: bool = True  # what is judged is then timed in the scene's own materials ...
    fewer: int = 0  # ... and in frames of so many samples, too; 0: of no others

    def plain(self) -> dict:
        return asdict(self)

    @staticmethod
    def from_plain(values: dict) -> "Job":
        lists = {k: tuple(v) for k, v in values.items() if isinstance(v, list)}
        probes = tuple(
            Probe(**{**p, "centre": tuple(p["centre"]), "half": tuple(p["half"]), "axes": tuple(map(tuple, p["axes"]))}) for p in values["probes"]
        )
        return Job(**{**values, **lists, "probes": probes, "groups": tuple(Groups(**g) for g in values["groups"])})
