"""Who takes part in a simulation: everybody in the venue, and those whose phones are recorded."""

from collections.abc import Iterator, Sequence

import numpy as np

from blesim import columns
from blesim.errors import ScenarioError
from blesim.observe import Carrier
from blesim.recording import Crowd, Person, Role, WalkKind
from blesim.rng import Draws
from blesim.scenario.build import Stage
from blesim.scenario.carried import CarriedFrom
from blesim.scenario.model import Scenario
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.recorded import Record, ShopperPhones
from blesim.scenario.walk_plan import WalkPlan
from blesim.tables import Carrying, Trajectory, Visits
from blesim.units import to_us
from blesim.walkers.day import Day, simulate_day
from blesim.walkers.gait import Gait
from blesim.walkers.person import PersonLog
from blesim.walkers.shop_floor import Progress
from blesim.walkers.survey import survey_walk
from blesim.walkers.walker import WalkLog, simulate_walkers

_CARRYING = dict(columns.CARRYINGS)


def everybody_in(stage: Stage, seed: int, progress: Progress | None = None) -> Day:
    """Everybody on the aisles of a stage, simulated together.

    Parameters
    ----------
    stage : Stage
        Who was told to walk, and the trading day if there is one.
    seed : int
        Of the simulation.
    progress : callable, optional
        Told how far a trading day has come: people who have left, and people.
    """
    if stage.graph is None:
        return Day(people=(), testers=(), turned_away=())
    if stage.day is None:
        logs = simulate_walkers(stage.graph, stage.itineraries)
        return Day(people=(), testers=logs, turned_away=())
    return simulate_day(stage.built, stage.day, stage.itineraries, seed, progress)


def carriers_of(file: ScenarioFile, stage: Stage, day: Day, seed: int) -> tuple[Carrier, ...]:
    """Whose phones are recorded: walks and surveys in the order of the scenario, then shoppers.

    Raises
    ------
    ScenarioError
        If more shoppers are to be recorded than came.
    """
    scenario = file.scenario
    testers = zip(scenario.walks, day.testers, strict=True)
    return (
        *(_tester(plan, log, scenario.record) for plan, log in testers),
        *_surveyors(scenario, stage),
        *_shoppers(file, day, seed),
    )


def crowd_of(stage: Stage, day: Day) -> Crowd:
    """Everybody who was in the store; nobody without a trading day."""
    if stage.day is None:
        return Crowd()
    people = [
        *(
            Person(name=p.name, role=Role[p.role.upper()], group=p.group, trajectory=p.trajectory)
            for p in day.people
        ),
        *(
            Person(name=itinerary.walker, role=Role.TESTER, trajectory=log.trajectory())
            for itinerary, log in zip(stage.itineraries, day.testers, strict=True)
        ),
    ]
    return Crowd(people=tuple(people), visits=_visits(stage, day))


def _visits(stage: Stage, day: Day) -> Visits:
    section = {section.id: row for row, section in enumerate(stage.built.sections)}
    rows = sorted(
        (arrived_us, person, section[name], dwell_us)
        for person, log in enumerate(day.people)
        for name, arrived_us, dwell_us in log.visits
    )
    if not rows:
        return Visits.empty()
    time_us, person, where, dwell_us = np.array(rows).T
    return Visits(time_us=time_us, person=person, section=where, dwell_us=dwell_us)


def _tester(plan: WalkPlan, log: WalkLog, record: Record) -> Carrier:
    trajectory = log.trajectory()
    return Carrier(
        name=plan.name,
        phone=plan.phone,
        kind=WalkKind.SURVEY if plan.kind == "survey" else WalkKind.WALK,
        split=plan.split,
        trajectory=trajectory,
        marks=log.pressed(),
        carrying=_carrying(plan.carrying, trajectory),
        gait=plan.gait,
        record=record,
    )


def _carrying(told: Sequence[CarriedFrom], trajectory: Trajectory) -> Carrying:
    start_us = int(trajectory.time_us[0])
    return Carrying(
        time_us=np.array([start_us + to_us(each.after_s) for each in told]),
        carrying=np.array([_CARRYING[each.carrying] for each in told]),
    )


def _surveyors(scenario: Scenario, stage: Stage) -> Iterator[Carrier]:
    for plan, survey in zip(scenario.surveys, stage.surveys, strict=True):
        trajectory, marks = survey_walk(survey)
        yield Carrier(
            name=plan.name,
            phone=plan.phone,
            kind=WalkKind.SURVEY,
            split=plan.split,
            trajectory=trajectory,
            marks=marks,
            carrying=_carrying(plan.carrying, trajectory),
            gait=Gait(),
            record=scenario.record,
        )


def _shoppers(file: ScenarioFile, day: Day, seed: int) -> Iterator[Carrier]:
    """Shoppers drawn by lot; a lot goes with a name, so that more shoppers change few of them."""
    shoppers = [person for person in day.people if person.role == "shopper"]
    lots = [
        Draws(seed=seed, purpose="recorded phone", walker=each.name).uniforms(np.zeros(1, int))
        for each in shoppers
    ]
    drawn = iter(np.argsort([lot[0, 0] for lot in lots], kind="stable").tolist())
    told = file.scenario.shopper_phones
    wanted = sum(phones.count for phones in told)
    if wanted > len(shoppers):
        reason = (
            f"{wanted} phones are to be recorded, but {len(shoppers)} shoppers came; record fewer"
            " or let more come"
        )
        raise ScenarioError(file.fault(["shopper_phones"], reason))
    for phones in told:
        chosen = sorted(next(drawn) for _ in range(phones.count))
        yield from (_shopper(shoppers[row], phones) for row in chosen)


def _shopper(person: PersonLog, phones: ShopperPhones) -> Carrier:
    return Carrier(
        name=person.name,
        phone=phones.phone,
        split=phones.split,
        trajectory=person.trajectory,
        carrying=person.carrying,
        gait=person.gait,
        record=phones,
        on_centre_line=False,
    )
