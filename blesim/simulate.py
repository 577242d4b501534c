"""From a scenario and a seed to what phones recorded and what really happened."""

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Self

import numpy as np

from blesim import __version__
from blesim.errors import InvariantError, UsageError
from blesim.imu.step_events import read_steps
from blesim.radio.air import Air
from blesim.radio.life import Lives, simulate_life
from blesim.recording import Observations, Provenance, Recording, Truth, Walk, WalkKind, WalkTruth
from blesim.rng import refuse_bad_seed
from blesim.scenario.build import Stage, set_stage
from blesim.scenario.model import Scenario, WalkPlan
from blesim.scenario.reading import ScenarioFile
from blesim.tables import Marks, Steps, StepTruth, Trajectory
from blesim.walkers.gait import steps_of
from blesim.walkers.walker import WalkLog, simulate_walkers
from blesim.workers import workers


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A simulation whose walkers have arrived: what phones heard is computed walk by walk.

    Attributes
    ----------
    scenario : Scenario
        Its parameters.
    seed : int
        Of all its random numbers.
    stage : Stage
        Venue and itineraries.
    logs : tuple of WalkLog
        One a walk.
    until_us : int
        Just after the last walker has arrived. [us]
    lives : Lives
        What befell the beacons until then.
    provenance : Provenance
        For the recording.
    """

    scenario: Scenario
    seed: int
    stage: Stage
    logs: tuple[WalkLog, ...]
    until_us: int
    lives: Lives
    provenance: Provenance

    @classmethod
    def run(cls, file: ScenarioFile, seed: int | None) -> Self:
        """Let everybody walk.

        Parameters
        ----------
        file : ScenarioFile
            What to simulate.
        seed : int or None
            Overrides the scenario's.

        Raises
        ------
        ScenarioError
            If the scenario contradicts itself.
        UsageError
            If neither gives a seed, or it is out of range.
        """
        seed = file.scenario.seed if seed is None else seed
        if seed is None:
            raise UsageError(f"{file.path}: no seed; give --seed N, or 'seed: N' in the scenario")
        refuse_bad_seed(seed)
        stage = set_stage(file, seed)
        logs = simulate_walkers(stage.graph, stage.itineraries)
        until_us = 1 + max(int(log.knots[-1][0]) for log in logs)
        return cls(
            scenario=file.scenario,
            seed=seed,
            stage=stage,
            logs=logs,
            until_us=until_us,
            lives=simulate_life(stage.built.beacons, file.scenario.beacon_events, until_us),
            provenance=Provenance(
                title=file.scenario.title,
                source=f"blesim {__version__}",
                license=file.scenario.license,
                scenario=file.text,
                seed=seed,
            ),
        )

    def air(self) -> Air:
        """What all phones have in common."""
        names = (plan.name for plan in self.scenario.walks)
        crowd = dict(zip(names, (log.trajectory() for log in self.logs), strict=True))
        return Air.over(
            self.stage.built,
            self.scenario.radio,
            self.seed,
            self.until_us,
            spells=self.lives.spells,
            crowd=crowd,
        )

    def walks(self, jobs: int = 1) -> Generator[tuple[Walk, WalkTruth], None, None]:
        """Walks with their truth, in the order of the scenario.

        Who does not take them all closes the generator, which ends its processes.

        Parameters
        ----------
        jobs : int
            Processes to share the work; the result is the same for any number.

        Raises
        ------
        BlesimError
            If one of several processes dies.
        """
        if jobs < 1:
            raise UsageError(f"jobs {jobs}: at least one process is needed")
        rows = range(len(self.logs))
        if jobs == 1 or len(rows) == 1:
            air = self.air()
            yield from (_observed(self, air, row) for row in rows)
            return
        with workers(min(jobs, len(rows)), _adopt, (self,)) as crew:
            yield from crew.results(_observed_by_worker, rows)

    def recording(self, jobs: int = 1) -> tuple[Recording, Truth]:
        """Recording and truth in memory."""
        pairs = list(self.walks(jobs))
        recording = Recording(
            venue=self.stage.surveyed,
            walks=tuple(walk for walk, _ in pairs),
            provenance=self.provenance,
        )
        truth = {walk.name: walk_truth for walk, walk_truth in pairs}
        return recording, Truth(
            venue=self.stage.built,
            walks=MappingProxyType(truth),
            beacon_events=self.lives.log,
        )


@dataclass(frozen=True, kw_only=True)
class _Adopted:
    """The simulation that a worker process works for; its air is made there once."""

    simulation: Simulation

    @cached_property
    def air(self) -> Air:
        return self.simulation.air()


_adopted: _Adopted | None = None


def _adopt(simulation: Simulation) -> None:
    global _adopted
    _adopted = _Adopted(simulation=simulation)


def _observed_by_worker(row: int) -> tuple[Walk, WalkTruth]:
    if _adopted is None:
        raise InvariantError("a worker was asked for a walk before it knew the simulation")
    return _observed(_adopted.simulation, _adopted.air, row)


def _observed(simulation: Simulation, air: Air, row: int) -> tuple[Walk, WalkTruth]:
    """What the phone of one walk recorded, and the truth about it."""
    plan, log, record = (
        simulation.scenario.walks[row],
        simulation.logs[row],
        simulation.scenario.record,
    )
    phone = simulation.scenario.phones[plan.phone]
    trajectory, marks = log.trajectory(), log.pressed()
    heard = air.heard_by(phone, plan.name, trajectory, keep_packets=record.packets)
    taken, read = StepTruth.empty(), Steps.empty()
    if record.steps:
        taken = steps_of(trajectory, plan.gait, simulation.seed, plan.name)
        read = read_steps(taken, phone.step_sensor, simulation.seed, plan.name)
    observations = Observations(readings=heard.readings, steps=read, marks=marks)
    _check(plan, simulation.stage, trajectory, observations)
    walk = Walk(
        name=plan.name,
        walker=plan.name,
        phone=plan.phone,
        carrying=plan.carrying,
        kind=WalkKind.SURVEY if plan.kind == "survey" else WalkKind.WALK,
        split=plan.split,
        observations=observations,
    )
    return walk, WalkTruth(trajectory=trajectory, steps=taken, packets=heard.packets)


def _check(
    plan: WalkPlan, stage: Stage, trajectory: Trajectory, observations: Observations
) -> None:
    """Raise `InvariantError` if a walk broke a law that holds for every walk."""
    for table in observations.tables():
        time_us = table[table.STREAM.columns[0]]
        if (
            len(time_us)
            and not trajectory.time_us[0] <= time_us[0] <= time_us[-1] <= trajectory.time_us[-1]
        ):
            raise InvariantError(f"walk '{plan.name}': {table.STREAM.group} outlasts the walk")
    _check_marks(plan, trajectory, observations.marks)
    _check_positions(plan, stage, trajectory)


def _check_marks(plan: WalkPlan, trajectory: Trajectory, marks: Marks) -> None:
    poses = trajectory.at(marks.time_us)
    if np.any(np.hypot(poses.x_m - marks.x_m, poses.y_m - marks.y_m) > 0.01):
        raise InvariantError(f"walk '{plan.name}': a way point was pressed somewhere else")


def _check_positions(plan: WalkPlan, stage: Stage, trajectory: Trajectory) -> None:
    """Knots lie on their edges; the edges were checked against shelves and walls before."""
    on_edge_m = stage.graph.xy_m(trajectory.edge, trajectory.offset_m)
    off_m = np.hypot(on_edge_m[:, 0] - trajectory.x_m, on_edge_m[:, 1] - trajectory.y_m)
    if np.any(off_m > 1e-4):
        raise InvariantError(f"walk '{plan.name}': a knot is not on the aisle it names")
