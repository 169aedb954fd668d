"""Inventory: the hardware of a mission, and the sets of RCs that satisfy an ARC.

Rules:

* A set has a different RC of the wanted kind for each role, matches the wish and the features, and respects every link:
  an RC with links to some RCs of a kind is never combined with another RC of that kind.
* The sets follow the order of the mission file: the resources of the first role vary slowest.
* The result has at least one set; otherwise a refusal names the part of the wish that no resource matches.

Source: S000, "static dependency database": all hardware available now, described right before the mission.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from backbone.dependency_database.messages import FindRcs, NoSuchHardware, Resource
from backbone.naming import did_you_mean

MOST_SETS = 4096  # chosen: 16 robots × 16 frequencies × 16 radios


class Inventory:
    """All hardware of one mission; it does not change while the mission runs.

    Args:
        resources: Resources with unique names, in the order of the mission file.
    """

    def __init__(self, resources: Sequence[Resource]) -> None:
        self._resources = tuple(resources)

    @property
    def resources(self) -> list[Resource]:
        """All resources, sorted by name."""
        return sorted(self._resources, key=lambda resource: resource.name)

    def sharable(self, sets: Iterable[Mapping[str, str]]) -> set[str]:
        """Return the names of the RCs in these sets that several ARCs may share."""
        named = {name for one in sets for name in one.values()}
        return {resource.name for resource in self._resources if resource.sharable and resource.name in named}

    def find(self, wanted: FindRcs) -> list[dict[str, str]]:
        """Return the sets of RCs that match, role → name, at most ``MOST_SETS``.

        Raises:
            NoSuchHardware: No set matches; facts: ``role``, the role without a match.
        """
        self._refuse_contradictions(wanted)
        candidates = {role: self._candidates(role, wanted) for role in wanted.roles}
        found: list[dict[str, str]] = []
        for chosen in _sets(list(wanted.roles), candidates, {}):
            found.append({role: resource.name for role, resource in chosen.items()})
            if len(found) == MOST_SETS:
                break
        if not found:
            raise _nothing_fits_together(wanted, candidates)
        return found

    def _refuse_contradictions(self, wanted: FindRcs) -> None:
        if not wanted.roles:
            raise NoSuchHardware("the question names no kind of hardware", role="")
        for what, roles in (("wish", wanted.wish), ("features", wanted.features)):
            for role in roles:
                if role not in wanted.roles:
                    hint = did_you_mean(role, wanted.roles)
                    raise NoSuchHardware(
                        f"the {what} names {role!r}{hint}, but only {_listed(wanted.roles)} is asked for", role=role
                    )

    def _candidates(self, role: str, wanted: FindRcs) -> list[Resource]:
        """Return the resources that match this role by themselves.

        Raises:
            NoSuchHardware: No resource matches this role.
        """
        kind = wanted.roles[role]
        of_kind = [resource for resource in self._resources if resource.type == kind]
        if not of_kind:
            hint = did_you_mean(kind, {resource.type for resource in self._resources})
            raise NoSuchHardware(f"no {kind!r} exists{hint}", role=role)
        name = wanted.wish.get(role)
        named = [resource for resource in of_kind if name in (None, resource.name)]
        if not named:
            names = [resource.name for resource in of_kind]
            raise NoSuchHardware(
                f"no {role} is named {name!r}{did_you_mean(str(name), names)}; there is {_listed(names)}",
                remedy=f"Use one of these names, or add the {role} to the mission file.",
                role=role,
                name=str(name),
            )
        features = wanted.features.get(role, [])
        fitting = [resource for resource in named if set(features) <= set(resource.features)]
        if not fitting:
            raise _lacks_features(role, named, features)
        return fitting


def _sets(
    roles: Sequence[str], candidates: Mapping[str, Sequence[Resource]], chosen: dict[str, Resource]
) -> Iterator[dict[str, Resource]]:
    """Yield every way to add the remaining roles to the chosen ones."""
    if len(chosen) == len(roles):
        yield chosen
        return
    role = roles[len(chosen)]
    for resource in candidates[role]:
        if all(_go_together(resource, other) for other in chosen.values()):
            yield from _sets(roles, candidates, {**chosen, role: resource})


def _go_together(one: Resource, other: Resource) -> bool:
    return one.name != other.name and _allows(one, other) and _allows(other, one)


def _allows(one: Resource, other: Resource) -> bool:
    return other.type not in one.links or other.name in one.links[other.type]


def _lacks_features(role: str, named: Sequence[Resource], features: Sequence[str]) -> NoSuchHardware:
    known = {feature for resource in named for feature in resource.features}
    who = named[0].name if len(named) == 1 else f"no {role}"
    for feature in features:
        if feature not in known:
            verb = "has no" if len(named) == 1 else "has"
            return NoSuchHardware(f"{who} {verb} {feature!r}{did_you_mean(feature, known)}", role=role, feature=feature)
    return NoSuchHardware(f"no {role} has all of {_listed(features)}", role=role)


def _nothing_fits_together(wanted: FindRcs, candidates: Mapping[str, Sequence[Resource]]) -> NoSuchHardware:
    """Name the first kind without a partner among the kinds before it, and the links of its resources."""
    for count in range(2, len(wanted.roles) + 1):
        roles = list(wanted.roles)[:count]
        if next(_sets(roles, candidates, {}), None) is None:
            break
    role, before = roles[-1], roles[:-1]
    why = [
        f"{one.name} goes only with {kind} {_listed(names)}"
        for other in roles
        for one in candidates[other]
        for kind, names in one.links.items()
        if kind in {wanted.roles[role] for role in roles}
    ]
    wish = ", ".join(f"{kind} {name}" for kind, name in wanted.wish.items() if kind in roles)
    detail = "; ".join(why) or f"the mission has too few of kind {wanted.roles[role]}"
    return NoSuchHardware(
        f"no {role} goes together with {_listed(before)}{f' as wished ({wish})' if wish else ''}: {detail}",
        role=role,
    )


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
