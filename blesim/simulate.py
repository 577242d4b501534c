"""From a scenario and a seed to what phones recorded and what really happened."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from types import MappingProxyType
from typing import Self

from blesim import __version__
from blesim.cast import carriers_of, crowd_of, everybody_in
from blesim.errors import UsageError
from blesim.observe import Carrier, observed
from blesim.radio.air import Air
from blesim.radio.life import Lives, simulate_life
from blesim.recording import Crowd, Provenance, Recording, Truth, Walk, WalkTruth
from blesim.rng import refuse_bad_seed
from blesim.scenario.build import Stage, set_stage
from blesim.scenario.model import Scenario
from blesim.scenario.reading import ScenarioFile
from blesim.walkers.shop_floor import Progress
from blesim.workers import shared


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
        Venue and who was told to walk in it.
    carriers : tuple of Carrier
        Whose phones are recorded: walks, surveys, then shoppers.
    crowd : Crowd
        Everybody who was in the store; nobody without a trading day.
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
    carriers: tuple[Carrier, ...]
    crowd: Crowd
    until_us: int
    lives: Lives
    provenance: Provenance

    @classmethod
    def run(cls, file: ScenarioFile, seed: int | None, progress: Progress | None = None) -> Self:
        """Let everybody walk.

        Parameters
        ----------
        file : ScenarioFile
            What to simulate.
        seed : int or None
            Overrides the scenario's.
        progress : callable, optional
            Told how far a trading day has come: people who have left, and people.

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
        day = everybody_in(stage, seed, progress)
        carriers = carriers_of(file, stage, day, seed)
        crowd = crowd_of(stage, day)
        walked = [*(each.trajectory for each in carriers), *(p.trajectory for p in crowd.people)]
        until_us = 1 + max(int(trajectory.time_us[-1]) for trajectory in walked)
        return cls(
            scenario=file.scenario,
            seed=seed,
            stage=stage,
            carriers=carriers,
            crowd=crowd,
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
        crowd = {carrier.name: carrier.trajectory for carrier in self.carriers}
        crowd |= {person.name: person.trajectory for person in self.crowd.people}
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
        yield from shared(_observer, (self,), range(len(self.carriers)), jobs)

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
            crowd=self.crowd,
        )


def _observer(simulation: Simulation) -> Callable[[int], tuple[Walk, WalkTruth]]:
    """What observes the carrier of a row; the air is made once for all of them."""
    air = simulation.air()

    def observer(row: int) -> tuple[Walk, WalkTruth]:
        return observed(
            simulation.scenario,
            simulation.stage.graph,
            simulation.seed,
            air,
            simulation.carriers[row],
        )

    return observer
