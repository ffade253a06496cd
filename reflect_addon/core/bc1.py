"""BC1 (DXT1) blocks: 4 x 4 texels in 8 bytes, 4 bits a texel, as light fields are stored in [yu-2005 section 7].

A block is two colours c0, c1 of 5:6:5 bits (uint16, little-endian, red on top), then 16 indices of 2 bits, a byte per row of
texels, the left one lowest. With c0 > c1 index 0 is c0, 1 is c1, 2 is (2 c0 + c1) / 3, 3 is (c0 + 2 c1) / 3; otherwise
2 is their mean and 3 is black: the encoder writes the former only.

Rows run as everywhere (core/spaces.py): block (0, 0) and a block's first byte of indices are at the bottom, so texel (x, y) of
a texture is [y, x] of the array. core/dds.py turns them for files.

Endpoints are those of the texels along their principal axis, then least squares for the indices chosen, then a search one
step around for each component; a nearly flat block may take its mean from the two colours between the ends, whose
steps are a third as large. The error is the plain sum of squares of r, g, b.
"""

import numpy as np

SIDE = 4  # texels a block's side
BYTES = 8  # a block
_LEVELS = np.array([31, 63, 31], np.float32)
_CHUNK = 8192  # blocks at a time: 1.5 MB of texels, and a dozen arrays of half that
_POWER_STEPS = 4  # of the power iteration for the principal axis
_FIT_STEPS = 2  # of least squares
_THIRDS = np.array([0, 1, 1 / 3, 2 / 3], np.float32)  # share of the second colour, by index, with c0 > c1
_HALVES = np.array([0, 1, 1 / 2, 0], np.float32)
_CODES = np.array([0, 2, 3, 1], np.uint8)  # index of the colour at 0, 1, 2, 3 thirds of the way from c0 to c1


def encode(rgb: np.ndarray) -> np.ndarray:
    """(H / 4, W / 4, 8) uint8 blocks of (H, W, 3) values; H and W are multiples of 4, values outside [0, 1] are clamped.

    ValueError for another shape; values must be finite. Temporary memory does not grow with H."""
    if rgb.ndim != 3 or rgb.shape[2] != 3 or 0 in rgb.shape or rgb.shape[0] % SIDE or rgb.shape[1] % SIDE:
        raise ValueError(f"an image of shape {rgb.shape} has no whole blocks of {SIDE} x {SIDE} texels")
    rows, columns = rgb.shape[0] // SIDE, rgb.shape[1] // SIDE
    blocks = np.empty((rows, columns, BYTES), np.uint8)
    at_once = max(_CHUNK // columns, 1)
    for row in range(0, rows, at_once):
        part = rgb[row * SIDE : (row + at_once) * SIDE]
        texels = part.reshape(-1, SIDE, columns, SIDE, 3).transpose(4, 1, 3, 0, 2).reshape(3, SIDE * SIDE, -1)
        into = blocks[row : row + at_once]
        into[...] = _encode(np.clip(texels, 0.0, 1.0, dtype=np.float32)).reshape(into.shape)
    return blocks


def decode(blocks: np.ndarray) -> np.ndarray:
    """(H, W, 3) float32 of (H / 4, W / 4, 8) uint8 blocks of either kind: the format's thirds, without rounding to 8 bits."""
    rows, columns = blocks.shape[:2]
    out = np.empty((rows * SIDE, columns * SIDE, 3), np.float32)
    x = np.arange(columns * SIDE)
    for row in range(rows):
        y = np.arange(row * SIDE, (row + 1) * SIDE)[:, None]
        out[row * SIDE : (row + 1) * SIDE] = texels(blocks, x, y)
    return out


def texels(blocks: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(..., 3) float32: the texels at integers x, y (broadcast against each other) inside the image, read from its blocks."""
    block = blocks[y // SIDE, x // SIDE]  # (..., 8)
    colours = np.ascontiguousarray(block[..., :4]).view("<u2")
    index = (np.take_along_axis(block, np.broadcast_to(4 + y % SIDE, block.shape[:-1])[..., None], -1)[..., 0] >> 2 * (x % SIDE)) & 3
    thirds = colours[..., 0] > colours[..., 1]
    share = np.where(thirds, _THIRDS[index], _HALVES[index])[..., None]
    first, second = _unpacked(colours[..., 0]), _unpacked(colours[..., 1])
    return np.where((thirds | (index < 3))[..., None], first + (second - first) * share, np.float32(0))


def extended(blocks: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The image made larger, to (rows, columns, 8): its top row and right column of texels go on, as a clamped look-up sees them."""
    height, width = blocks.shape[:2]
    out = np.empty((rows, columns, BYTES), np.uint8)
    out[:height, :width] = blocks
    out[:height, width:] = blocks[:, -1:]
    out[:height, width:, 4:] = (out[:height, width:, 4:] >> 6) * 0x55  # each row's last index, four times
    out[height:] = out[height - 1]
    out[height:, :, 4:7] = out[height:, :, 7:]
    return out


def _unpacked(colour: np.ndarray) -> np.ndarray:
    return np.stack([colour >> 11, (colour >> 5) & 63, colour & 31], -1).astype(np.float32) / _LEVELS


# --- encoding; texels are (3, 16, N), endpoints (3, N) in steps of 5:6:5, held as float32


def _encode(x: np.ndarray) -> np.ndarray:
    """(N, 8) blocks of texels in [0, 1]."""
    mean = x.mean(1)
    x -= mean[:, None]
    fit = _Fit(x, mean)
    fit.try_ends(*_along_axis(x, mean))
    for _ in range(_FIT_STEPS):
        fit.try_ends(*_least_squares(x, mean, fit.steps))
    fit.try_ends(*_between(mean))
    fit.search()
    return _packed(*fit.ends, fit.steps)


class _Fit:
    """The best endpoints so far of N blocks, with the texels' steps 0 to 3 from the first to the second, (16, N)."""

    def __init__(self, x: np.ndarray, mean: np.ndarray):
        self.x, self.mean = x, mean
        self.ends = np.zeros((2, *mean.shape), np.float32)
        self.steps = np.zeros(x.shape[1:], np.float32)
        self.error = np.full(mean.shape[1:], np.inf, np.float32)  # less the part that no endpoints change

    def try_ends(self, first: np.ndarray, second: np.ndarray):
        """Takes these endpoints where they are better."""
        low = first / _LEVELS[:, None]
        way = second / _LEVELS[:, None] - low
        length = (way * way).sum(0)
        off = self.mean - low
        along = self.x[0] * way[0]
        along += self.x[1] * way[1]
        along += self.x[2] * way[2]
        along += (off * way).sum(0)
        steps = np.rint(along * (3.0 / np.maximum(length, 1e-12)))
        np.clip(steps, 0.0, 3.0, out=steps)
        along *= 2.0 / 3.0
        along -= steps * (length / 9.0)
        along *= steps
        error = 16.0 * (off * off).sum(0) - along.sum(0)
        better = error < self.error
        np.copyto(self.ends[0], first, where=better)
        np.copyto(self.ends[1], second, where=better)
        np.copyto(self.steps, steps, where=better)
        np.copyto(self.error, error, where=better)

    def search(self):
        """One step up and down for each component of each endpoint."""
        for end in range(2):
            for channel in range(3):
                for step in (-1.0, 1.0):
                    moved = self.ends.copy()
                    moved[end, channel] = np.clip(moved[end, channel] + step, 0.0, _LEVELS[channel])
                    self.try_ends(*moved)


def _rounded(ends: np.ndarray) -> np.ndarray:
    return np.rint(np.clip(ends, 0.0, 1.0) * _LEVELS[:, None])


def _along_axis(x: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Endpoints: the outermost texels along the principal axis."""
    covariance = np.empty((3, 3, x.shape[2]), np.float32)
    for i in range(3):
        for j in range(i, 3):
            covariance[i, j] = covariance[j, i] = (x[i] * x[j]).sum(0)
    largest = np.argmax(covariance[[0, 1, 2], [0, 1, 2]], 0)
    axis = np.take_along_axis(covariance, largest[None, None], 0)[0]
    for _ in range(_POWER_STEPS):
        axis /= np.maximum(np.abs(axis).max(0), 1e-20)
        axis = (covariance * axis).sum(1)
    axis /= np.maximum(np.sqrt((axis * axis).sum(0)), 1e-20)
    along = (x * axis[:, None]).sum(0)
    return _rounded(mean + axis * along.min(0)), _rounded(mean + axis * along.max(0))


def _least_squares(x: np.ndarray, mean: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The endpoints that fit the texels best with these steps; where they all agree, the mean twice."""
    share = steps * (1.0 / 3.0)
    centre = share.mean(0)
    share -= centre
    spread = (share * share).sum(0)
    slope = np.stack([(channel * share).sum(0) for channel in x]) / np.where(spread > 1e-6, spread, np.inf)
    return _rounded(mean - slope * centre), _rounded(mean + slope * (1.0 - centre))


def _between(mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbouring endpoints a, b with (2 a + b) / 3 at the mean: 3 k, 3 k + 1, 3 k + 2 are 2 k + k, 2 k + (k + 1), 2 (k + 1) + k."""
    whole = np.rint(mean * (3.0 * _LEVELS[:, None]))
    third = np.floor(whole / 3.0)
    rest = whole - 3.0 * third
    return third + (rest == 2.0), third + (rest == 1.0)


def _packed(first: np.ndarray, second: np.ndarray, steps: np.ndarray) -> np.ndarray:
    colours = [(r.astype(np.uint16) << 11) | (g.astype(np.uint16) << 5) | b.astype(np.uint16) for r, g, b in (first, second)]
    steps = np.where(colours[0] < colours[1], 3.0 - steps, steps)
    steps *= colours[0] != colours[1]
    codes = _CODES[steps.astype(np.uint8)].reshape(SIDE, SIDE, -1)
    out = np.empty((codes.shape[2], BYTES), np.uint8)
    out[:, :4] = np.stack([np.maximum(*colours), np.minimum(*colours)], -1).astype("<u2").view(np.uint8)
    out[:, 4:] = (codes[:, 0] | codes[:, 1] << 2 | codes[:, 2] << 4 | codes[:, 3] << 6).T
    return out
