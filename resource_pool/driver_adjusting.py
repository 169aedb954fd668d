"""Changed parameters reach all drivers of an RC, or none."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from backbone.component.messages import WrongParameter
from backbone.errors import Refusal, complaint
from backbone.exchange_course import UNPROVED
from resource_pool.drivers.interface import AdjustableDriver, DriverSite, NoOptions
from resource_pool.messages import NeedsRestart


def adjust_changed(drivers: Sequence[Any], site: DriverSite, former: DriverSite, adjustable: Collection[str]) -> None:
    """Have the drivers apply what is changed, if they can; see ``ResourceController.parameters_changed``.

    Args:
        site: With the changed parameters.
        former: With the parameters in force.
        adjustable: Parameters that a driver may change while it runs.
    """
    before, now = former.parameters, site.parameters
    changed = {name for name in now.__struct_fields__ if getattr(before, name) != getattr(now, name)}
    for_driver = changed & {*adjustable}
    fixed = changed - for_driver - {"capacity"}
    unable = [driver for driver in drivers if not hasattr(driver, "adjust")]
    if fixed or (for_driver and (unable or not drivers)):
        raise NeedsRestart(f"{site.resource} cannot change {', '.join(sorted(fixed or for_driver))} while it runs")
    if for_driver:
        _adjust_all(drivers, site, former)


def _adjust_all(drivers: Sequence[AdjustableDriver], site: DriverSite, former: DriverSite) -> None:
    """Have all drivers apply the parameters of this site.

    Args:
        site: With the changed parameters.
        former: With the parameters in force.

    Raises:
        Refusal: A driver refuses its options, or cannot apply them; the parameters in force are restored.
    """
    for driver in drivers:
        site.options(getattr(driver, "options_type", NoOptions))
    for number, driver in enumerate(drivers):
        try:
            driver.adjust(site)
        except UNPROVED as error:
            is_refusal = isinstance(error, Refusal)  # then it changed nothing
            are_back = [_is_back(one, former) for one in (drivers[:number] if is_refusal else drivers[: number + 1])]
            if is_refusal:
                raise
            kept = "" if all(are_back) else "; it may have kept a part of the change"
            raise WrongParameter(
                f"the driver of {site.resource} failed while it changed: {complaint(error)}{kept}",
                remedy="Mend the driver's adjust; the component uses the value from its next start on.",
            ) from error


def _is_back(driver: AdjustableDriver, former: DriverSite) -> bool:
    try:
        driver.adjust(former)
    except UNPROVED:
        return False
    return True
