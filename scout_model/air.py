"""The air between the robots and the base: a model of signal strength, fading and packet loss.

Pure functions of distance, time and seed; ``scout_model.video_link`` and ``scout_model.radio_air``
make pictures and packets of them.

Sources of the models:

* Path loss: log-distance, as fitted indoors (Rappaport, "Wireless Communications", section 4.9).
* Fading: Rayleigh fading as a sum of waves from all directions, after Clarke and Jakes (Jakes, "Microwave Mobile
  Communications", chapter 1): share of time below a level, and mean duration of a fade.
* Kinds of noise: RAM 2002, "Visual Servoing" and "Distributed Surveillance Task" (motors, multipath,
  weak signal; horizontal lines, white noise, partial images with whole wrong rows).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scout_model.description import AirDescription

SNR_AT_1_M_DB = 46.0  # chosen: a good analog picture near the antenna
LOSS_DB_PER_DECADE = 22.0  # chosen: a little more than the 20 of free space, an open room
REFERENCE_M = 4.0  # chosen: from the middle of the papers' rooms, about 9 x 6 m, to where their Scouts stood
NEAREST_M = 0.1  # chosen: below, the far-field formula does not hold

FADED_SHARE = 0.25  # chosen: with FADE_S it explains the fifth of motions that RAM 2002 missed without other load
FADE_S = 0.15  # chosen: same; mean duration of a fade at FADED_SHARE
WAVES = 48  # chosen: enough to match Rayleigh's share of fades within a few per cent

RADIO_SNR_AT_1_M_DB = 46.0  # chosen: as for video; packets then reach across any room, but not across a street
LIGHT_M_PER_S = 299_792_458.0
_WORD = 2**32 - 1

_DEPTH = -math.log(1.0 - FADED_SHARE)  # relative power below which a Rayleigh fading signal is for this share of time
_DOPPLER_HZ = (math.exp(_DEPTH) - 1.0) / (math.sqrt(2 * math.pi * _DEPTH) * FADE_S)  # Jakes: duration of a fade


def distance_m(position_m: Sequence[float], antenna_m: Sequence[float]) -> float:
    """Return the distance of a robot from the antenna, at least ``NEAREST_M``; positions are x, y, z in metres."""
    return max(NEAREST_M, math.dist(position_m, antenna_m))


def antenna_m(air: AirDescription, width_m: float, depth_m: float) -> tuple[float, float, float]:
    """Return the position of the base's antenna in a room of this size: x, y, z in metres."""
    return (
        width_m / 2 if air.antenna_x_m is None else air.antenna_x_m,
        depth_m / 2 if air.antenna_y_m is None else air.antenna_y_m,
        air.antenna_z_m,
    )


def counted_distance_m(away_m: float, weak_signal: float) -> float:
    """Return the effective distance: at it a full path loss equals the weakened path loss at ``away_m``.

    Args:
        away_m: Real distance, above 0.
        weak_signal: Weight of the distance; 1: full path loss, 0: none.

    Example:
        >>> counted_distance_m(9.0, weak_signal=1.0), counted_distance_m(9.0, weak_signal=0.0)
        (9.0, 4.0)
    """
    return REFERENCE_M * math.pow(away_m / REFERENCE_M, weak_signal)


def snr_db(away_m: float) -> float:
    """Return the video's signal-to-noise ratio without fading, in dB: white level to the noise's standard deviation."""
    return SNR_AT_1_M_DB - LOSS_DB_PER_DECADE * math.log10(away_m)


def fade_level(away_m: float) -> float:
    """Return the power, as a share of its mean, below which a picture from this distance is lost.

    The level grows with distance, because the mean power shrinks. At ``REFERENCE_M``, the power is below the level for
    ``FADED_SHARE`` of the time.
    """
    return _DEPTH * math.pow(away_m / REFERENCE_M, LOSS_DB_PER_DECADE / 10)


def packet_loss(away_m: float, bits: int) -> float:
    """Return the probability that a packet of this many bits contains a wrong bit.

    Source: bit error rate of a non-coherent frequency-shift modem, one half of exp(-SNR / 2) (Proakis, "Digital
    Communications", section 5.4).

    Example:
        >>> packet_loss(5.0, 100) < 1e-20, round(packet_loss(50.0, 100), 2)
        (True, 0.73)
    """
    ratio = 10 ** ((RADIO_SNR_AT_1_M_DB - LOSS_DB_PER_DECADE * math.log10(away_m)) / 10)
    return -math.expm1(bits * math.log1p(-0.5 * math.exp(-ratio / 2)))


class Fading:
    """Fading of one robot's signal: its relative power as echoes add up and cancel out; 1 on average.

    Args:
        key: Non-negative integers; the same key gives the same course of power.
    """

    def __init__(self, key: Sequence[int]) -> None:
        rng = np.random.default_rng(key)
        # Half a circle has all Doppler shifts of a whole one; one wave from each part of it keeps runs similar.
        directions_rad = math.pi * (np.arange(WAVES) + rng.random(WAVES)) / WAVES
        self._turns_rad_s: NDArray[np.float64] = 2 * math.pi * _DOPPLER_HZ * np.cos(directions_rad)
        self._phases_rad: NDArray[np.float64] = rng.uniform(0.0, 2 * math.pi, WAVES)

    def power(self, time_s: float) -> float:
        """Return the power at this time, as a share of its mean."""
        angles_rad = self._turns_rad_s * time_s + self._phases_rad
        return float((np.cos(angles_rad).sum() ** 2 + np.sin(angles_rad).sum() ** 2) / WAVES)


def key_of(name: str) -> int:
    """Return a number for a name, the same in every process."""
    return zlib.crc32(name.encode())


def words_of(number: int) -> list[int]:
    """Return the 32-bit words that NumPy makes of a number in a seed; from those it makes a generator sooner.

    Example:
        >>> words_of(5), words_of(2**32 + 7)
        ([5], [7, 1])
    """
    words = [number & _WORD]
    while number := number >> 32:
        words.append(number & _WORD)
    return words
