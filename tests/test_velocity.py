"""The velocity field as arrays: a pattern moved by Fourier's shift theorem."""

import memo
import numpy as np

SIZE = (80, 100)
MOVED_PX = (0.8, -0.5)


def moved(pattern, by_px):
    v, u = np.meshgrid(*map(np.fft.fftfreq, SIZE), indexing="ij")
    turned = np.fft.fft2(pattern) * np.exp(-2j * np.pi * (u * by_px[0] + v * by_px[1]))
    return np.real(np.fft.ifft2(turned))


def test_a_moved_pattern_has_its_velocity_in_every_pixel_of_the_region_and_in_no_other():
    rough = np.random.default_rng(0).normal(size=SIZE)
    v, u = np.meshgrid(*map(np.fft.fftfreq, SIZE), indexing="ij")
    smooth = np.real(np.fft.ifft2(np.fft.fft2(rough) * np.exp(-100 * (u**2 + v**2))))
    levels = 25 + 200 * (smooth - smooth.min()) / np.ptp(smooth)
    first, second = (moved(levels, by).clip(0, 255).round().astype(np.uint8) for by in ((0, 0), MOVED_PX))
    region = np.zeros(SIZE, bool)
    region[20:50, 30:80] = True
    for component, wanted in zip(memo.velocity_field(first, second, region), MOVED_PX, strict=True):
        np.testing.assert_array_equal(np.isfinite(component), region)
        np.testing.assert_allclose(component[region], wanted, atol=0.05)
