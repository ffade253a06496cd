"""Images continued beyond what they show, by pull and push (Gortler et al. 1996, section 3.4, in its simplest form)."""

import numpy as np


def continued(image: np.ndarray) -> np.ndarray:
    """(h, w, 4) float32, alpha 1 everywhere: where alpha is 0, the mean of what is near; sides are powers of two.

    image: (h, w, 4) premultiplied. An empty image stays black."""
    h, w = image.shape[:2]
    if min(h, w) == 1:
        total = image.reshape(-1, 4).sum(0)
        mean = total / total[3] if total[3] > 0 else np.float32([0, 0, 0, 1])
        coarse = np.broadcast_to(mean.astype(np.float32), image.shape)
    else:
        coarse = continued(image.reshape(h // 2, 2, w // 2, 2, 4).mean((1, 3)))
        coarse = coarse.repeat(2, 0).repeat(2, 1)
    return (image + (1.0 - image[..., 3:]) * coarse).astype(np.float32)
