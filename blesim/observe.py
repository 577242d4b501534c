"""What one phone records while it is carried, and the truth about it."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from blesim.columns import CARRYINGS, NO_EDGE
from blesim.errors import InvariantError
from blesim.imu.barometer import pressure
from blesim.imu.feel import feel
from blesim.imu.fused_heading import fused_heading
from blesim.imu.step_events import read_steps
from blesim.radio.air import Air
from blesim.recording import Observations, Walk, WalkKind, WalkTruth
from blesim.scenario.model import Scenario
from blesim.scenario.recorded import Record
from blesim.tables import Carrying, Marks, StepTruth, Trajectory
from blesim.venue.graph import AisleGraph
from blesim.walkers.gait import Gait, steps_of

_OFF_AISLE_M = 1e-4
_OFF_MARK_M = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Carrier:
    """Somebody who carries a phone that is recorded.

    Attributes
    ----------
    name : str
        Of the walk, and of whoever walks.
    phone : str
        A name of the scenario's phones.
    kind : WalkKind
    split : str
    trajectory : Trajectory
        Where the carrier goes.
    marks : Marks
        What a tester pressed.
    carrying : Carrying
        How the phone is carried.
    gait : Gait
        How the carrier steps.
    record : Record
        What of it is recorded.
    on_centre_line : bool
        Whether the carrier keeps to the centre of the aisles, as testers do.
    """

    name: str
    phone: str
    kind: WalkKind = WalkKind.WALK
    split: str = ""
    trajectory: Trajectory
    marks: Marks = field(default_factory=Marks.empty)
    carrying: Carrying
    gait: Gait
    record: Record
    on_centre_line: bool = True


def observed(
    scenario: Scenario, graph: AisleGraph | None, seed: int, air: Air, carrier: Carrier
) -> tuple[Walk, WalkTruth]:
    """What the phone of one carrier recorded, and the truth about it.

    Parameters
    ----------
    scenario : Scenario
        Whose phones and magnetic field.
    graph : AisleGraph or None
        Of the venue as built.
    seed : int
        Of the simulation.
    air : Air
        What all phones have in common.
    carrier : Carrier
        Who carries the phone where.

    Raises
    ------
    InvariantError
        If the walk broke a law that holds for every walk.
    """
    phone, record = scenario.phones[carrier.phone], carrier.record
    name, trajectory, carrying = carrier.name, carrier.trajectory, carrier.carrying
    heard = air.heard_by(phone, name, trajectory, keep_packets=record.packets, carrying=carrying)
    # A fused heading is off by so much a straight stretch, and the steps tell those.
    walked = record.steps or record.imu or record.headings
    taken = steps_of(trajectory, carrier.gait, seed, name) if walked else StepTruth.empty()
    observations = replace(
        _felt(scenario, seed, carrier, taken), readings=heard.readings, marks=carrier.marks
    )
    _check(carrier, graph, observations)
    walk = Walk(
        name=name,
        walker=name,
        phone=carrier.phone,
        carrying=carrying_text(carrying),
        kind=carrier.kind,
        split=carrier.split,
        observations=observations,
    )
    truth = WalkTruth(trajectory=trajectory, steps=taken, packets=heard.packets, carrying=carrying)
    return walk, truth


def carrying_text(carrying: Carrying) -> str:
    """Ways of carrying in the order in which they first occur, with commas between them."""
    names = {value: name for name, value in CARRYINGS}
    return ", ".join(dict.fromkeys(names[mode] for mode in carrying.carrying.tolist()))


def _felt(scenario: Scenario, seed: int, carrier: Carrier, taken: StepTruth) -> Observations:
    """What sensors other than the radio tell, as far as it is recorded."""
    phone, record, name = scenario.phones[carrier.phone], carrier.record, carrier.name
    trajectory, carrying = carrier.trajectory, carrier.carrying
    end_us = int(trajectory.time_us[-1])
    told: dict[str, Any] = {}
    if record.steps:
        told["steps"] = read_steps(taken, phone.step_sensor, seed, name, carrying, end_us)
    if record.imu:
        felt = feel(phone.imu, scenario.magnetics, trajectory, taken, carrying, seed, name)
        told["imu"] = felt.imu
    if record.headings:
        told["headings"] = fused_heading(
            trajectory, taken, carrying, phone.heading_sensor, phone.step_sensor, seed, name
        )
    if record.pressures:
        height_m = scenario.radio.level_height_m
        told["pressures"] = pressure(trajectory, carrying, height_m, phone.barometer, seed, name)
    return Observations(**told)


def _check(carrier: Carrier, graph: AisleGraph | None, observations: Observations) -> None:
    """Raise `InvariantError` if a walk broke a law that holds for every walk."""
    time_us = carrier.trajectory.time_us
    for table in observations.tables():
        told_us = table[table.STREAM.columns[0]]
        if len(told_us) and not time_us[0] <= told_us[0] <= told_us[-1] <= time_us[-1]:
            raise InvariantError(f"walk '{carrier.name}': {table.STREAM.group} outlasts the walk")
    _check_marks(carrier)
    # Shoppers walk beside the centre line; the trading day checks where.
    if graph is not None and carrier.on_centre_line:
        _check_positions(carrier, graph)


def _check_marks(carrier: Carrier) -> None:
    marks = carrier.marks
    poses = carrier.trajectory.at(marks.time_us)
    if np.any(np.hypot(poses.x_m - marks.x_m, poses.y_m - marks.y_m) > _OFF_MARK_M):
        raise InvariantError(f"walk '{carrier.name}': a way point was pressed somewhere else")


def _check_positions(carrier: Carrier, graph: AisleGraph) -> None:
    """Knots of a tester lie on their edges, which were checked against shelves and walls before."""
    walked = carrier.trajectory
    rows = np.flatnonzero(walked.edge != NO_EDGE)
    on_edge_m = graph.xy_m(walked.edge[rows], walked.offset_m[rows])
    off_m = np.hypot(on_edge_m[:, 0] - walked.x_m[rows], on_edge_m[:, 1] - walked.y_m[rows])
    if np.any(off_m > _OFF_AISLE_M):
        raise InvariantError(f"walk '{carrier.name}': a knot is not on the aisle it names")
