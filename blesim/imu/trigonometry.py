"""Sine and cosine out of additions and multiplications alone, which every processor rounds alike.

The polynomials are the Taylor series on an eighth of a turn either way, off by less than 1e-13.
"""

import numpy as np

from blesim.kernels import kernel

_QUARTER_RAD = 1.5707963267948966
_PER_QUARTER = 0.6366197723675814
# Coefficients of t^3 to t^13 of the sine, and of t^2 to t^14 of the cosine.
_S3, _S5, _S7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
_S9, _S11, _S13 = 1.0 / 362880.0, -1.0 / 39916800.0, 1.0 / 6227020800.0
_C4, _C6, _C8 = 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0
_C10, _C12, _C14 = -1.0 / 3628800.0, 1.0 / 479001600.0, -1.0 / 87178291200.0


@kernel
def sine_cosine(angle_rad: float) -> tuple[float, float]:
    """Sine and cosine of an angle (kernel). [-]."""
    quarters = np.floor(_PER_QUARTER * angle_rad + 0.5)
    t = angle_rad - quarters * _QUARTER_RAD
    u = t * t
    s = ((((_S13 * u + _S11) * u + _S9) * u + _S7) * u + _S5) * u + _S3
    sine = t + t * u * s
    c = (((((_C14 * u + _C12) * u + _C10) * u + _C8) * u + _C6) * u + _C4) * u - 0.5
    cosine = 1.0 + u * c
    quadrant = np.int64(quarters) & 3
    if quadrant == 0:
        return sine, cosine
    if quadrant == 1:
        return cosine, -sine
    if quadrant == 2:
        return -sine, -cosine
    return -cosine, sine
