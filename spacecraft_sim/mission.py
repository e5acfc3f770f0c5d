"""The composition root: a scenario becomes plants, a law with its guarantees, and flights.

Beside the command line this is the only module that knows the controllers.
"""

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, get_args

from pydantic import TypeAdapter, create_model

import controllers
from controllers import REGISTRY, Design, modulation_claims
from controllers.burkov_energy import Body
from controllers.modulation import Modulation, asked_for, modulated
from spacecraft_sim import (
    beam,
    compiled_dynamics,
    compiled_mechanism,
    config,
    conservation,
    errata,
    library,
    linearize,
    mjcf,
    reduced,
    spacecraft,
)
from spacecraft_sim.chart import charts_of, portraits
from spacecraft_sim.checks import choices
from spacecraft_sim.compare import Comparison, compare
from spacecraft_sim.controller import Controller
from spacecraft_sim.disturbance import Disturbance
from spacecraft_sim.equations import EquationsPhysics
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.mechanisms import FlexibleMechanism, Mechanism
from spacecraft_sim.physics import MujocoPhysics
from spacecraft_sim.plant import PlantName
from spacecraft_sim.reduced import ReducedModel, ReducedPhysics
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters
from spacecraft_sim.trajectory import Trajectory
from spacecraft_sim.versions import versions


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """Everything that a scenario stands for, ready to fly.

    Attributes:
        scenario: The scenario.
        machine: The spacecraft that flies in MuJoCo.
        mujoco: The full plant.
        reduced: The reduced plant.
        design: The function that designed the law.
        controller: The law.
        guarantees: What is claimed of it.
        thrusters: The thrusters of each plant.
        disturbance: The disturbance torques.
    """

    scenario: Scenario
    machine: Spacecraft
    mujoco: MujocoPhysics
    reduced: ReducedPhysics | EquationsPhysics
    design: Design
    controller: Controller
    guarantees: tuple[Guarantee, ...]
    thrusters: dict[PlantName, Thrusters]
    disturbance: Disturbance

    @property
    def accuracy(self) -> float | None:
        """The accuracy asked of the law, or that its charts promise, rad; None if there is none."""
        bands = [portrait.band for portrait in portraits(charts_of(self.controller))]
        return self.scenario.controller.get("accuracy", next(iter(bands), None))

    @property
    def bands(self) -> dict[str, float]:
        """Half-widths that the charts of the law promise to keep to about zero, by signal, rad."""
        drawn = portraits(charts_of(self.controller))
        return {chart.signals[0]: chart.band for chart in drawn if chart.band}

    @property
    def errata(self) -> tuple[errata.Section, ...]:
        """Known misprints of the papers that the law, its module or its claims cite."""
        own = self.guarantees
        if isinstance(self.reduced, ReducedPhysics):  # balances are true of any law
            balances = conservation.momentum_balances(self.reduced.model)
            own = own[: len(own) - len(balances)]
        about = (self.design, sys.modules[self.design.__module__])
        cited = "\n".join([*(part.__doc__ or "" for part in about), *(g.source for g in own)])
        listed = Path(controllers.__file__ or "").with_name("ERRATA.md")
        found = errata.sections(listed.read_text(encoding="utf-8"))
        return tuple(section for section in found if section.concerns(cited))

    @property
    def linear_model(self) -> ReducedModel:
        """The linear model that flies as the reduced plant.

        Raises:
            ValueError: If the reduced plant is the machine's own equations of motion.
        """
        return _linear(self.reduced)

    def environment(self, plant: PlantName = "mujoco") -> Environment:
        """Returns a dm_control environment with the law closed inside its task.

        Args:
            plant: Which plant.
        """
        task = ControlTask(
            self.controller,
            self.thrusters[plant],
            initial=self.scenario.initial,
            disturbance=self.disturbance,
            input_units=self.mujoco.input_units,
            accuracy=self.accuracy or 1e-2,
            seed=self.scenario.seed,
        )
        return Environment(
            self.mujoco if plant == "mujoco" else self.reduced,
            task,
            duration=self.scenario.duration,
            substeps=self.scenario.simulation.substeps,
        )

    def fly(
        self,
        plant: PlantName = "mujoco",
        *,
        progress: Callable[[float], None] | None = None,
        watch: Callable[[Trajectory], None] | None = None,
    ) -> Trajectory:
        """Flies the scenario on one plant.

        Args:
            plant: Which plant.
            progress: Called with the simulated time, s.
            watch: Called during the flight with its rows, some at a time, each row once.
        """
        meta = {
            "plant": plant,
            "scenario": self.scenario.name,
            "seed": self.scenario.seed,
            "versions": versions(),
        }
        return simulate(self.environment(plant), meta=meta, progress=progress, watch=watch)

    def judge(self, measured: Trajectory, predicted: Trajectory) -> Comparison:
        """Checks the guarantees on both flights and compares them.

        Args:
            measured: Flight of the MuJoCo plant.
            predicted: Flight of the reduced plant.
        """
        return compare(measured, predicted, self.guarantees)


def load_scenario(
    name: str | Path, settings: tuple[str, ...] = (), laws: Mapping[str, Design] = REGISTRY
) -> Scenario:
    """Reads a scenario and validates all of it, the parameters of its law included.

    Args:
        name: Name of a shipped scenario, or path of a TOML file.
        settings: `key=value` assignments.
        laws: Designs by name.

    Raises:
        ValueError: Naming every fault with its path.
    """
    path = Path(name)
    if path.suffix != ".toml":
        known = library.scenario_names()
        if str(name) not in known:
            raise ValueError(choices("scenario", str(name), known, where="the library"))
        path = library.folder("scenarios") / f"{name}.toml"
    table = _with_machine_found({"name": path.stem, **config.read(path)}, path.parent)
    table = _with_machine_found(config.override(table, settings), Path())
    faults = config.faults(Scenario, table) + _controller_faults(table.get("controller"), laws)
    faults += _part_faults(table)
    if faults:
        raise ValueError("\n".join([f"{path}:", *faults]))
    return config.validate(Scenario, table, where=str(path))


def _with_machine_found(table: config.Table, folder: Path) -> config.Table:
    """A spacecraft given by its file is looked for in the folder of whoever names it."""
    machine = table.get("spacecraft")
    if isinstance(machine, str) and machine.endswith(".toml"):
        return {**table, "spacecraft": str((folder / machine).resolve())}
    return table


def assemble(scenario: Scenario, laws: Mapping[str, Design] = REGISTRY) -> Mission:
    """Builds the plants, designs the law and collects what is guaranteed.

    Args:
        scenario: The scenario.
        laws: Designs by name.

    Raises:
        ValueError: If machine, law and scenario do not fit together; the message says where.
    """
    nominal = spacecraft.load(scenario.spacecraft).with_parts(**scenario.changes())
    machine = nominal.with_parts(**scenario.actual_changes())
    disturbance = Disturbance(scenario.disturbance)
    build = partial(
        MujocoPhysics.fly,
        timestep=scenario.simulation.timestep,
        disturbances=disturbance.names,
    )
    full = build(machine)
    known = full if machine == nominal else build(nominal)
    plant = reduced_plant(scenario, nominal, known)
    thrusters = Thrusters(nominal.thrusters)
    name = scenario.controller["law"]
    parameters = _parameters(laws[name], scenario.controller)
    design = laws[name]
    try:
        law, guarantees = design(
            _known_model(design, plant, known.model.ptr), thrusters, **parameters
        )
        if modulation := asked_for(scenario.controller):
            law = modulated(law, modulation, thrusters)
            met = partial(compiled_dynamics.inertias, known, law.thrusters)
            guarantees = modulation_claims.claims(law, met)
    except ValueError as error:
        raise ValueError(f"{scenario.name}, law {name}: {error}") from error
    if isinstance(plant, reduced.ReducedPhysics):
        guarantees += conservation.momentum_balances(plant.model)
    mission = Mission(
        scenario=scenario,
        machine=machine,
        mujoco=full,
        reduced=plant,
        design=design,
        controller=law,
        guarantees=guarantees,
        thrusters={"mujoco": Thrusters(machine.thrusters), "reduced": thrusters},
        disturbance=disturbance,
    )
    for kind in ("mujoco", "reduced"):  # start, sensors and what is claimed must exist on both
        environment = mission.environment(kind)
        needs = {f"the law {name} reads it": law.sensors}
        needs |= {f"not the law but '{g.claim}' is judged by it": g.signals for g in guarantees}
        for why, names in needs.items():
            try:
                environment.physics.select(names)
            except ValueError as error:
                raise ValueError(f"{scenario.name}: {error}; {why}") from error
        environment.reset()
    return mission


ReducedPlant = ReducedPhysics | EquationsPhysics

# What a design asks for by the type of its first argument, read off the compiled machine.
_MODELS: dict[Any, Callable[[Any], Any]] = {
    Mechanism: compiled_mechanism.mechanism,
    FlexibleMechanism: compiled_mechanism.flexible_mechanism,
    Body: compiled_mechanism.body,
}


def _known_model(design: Design, plant: ReducedPlant, model: Any) -> Any:
    """What a law may know of its machine: the linear model, unless its design asks for another."""
    first = next(iter(inspect.signature(design, eval_str=True).parameters.values())).annotation
    for kind in get_args(first) or (first,):
        if kind in _MODELS:
            return _MODELS[kind](model)
    return _linear(plant)


def _linear(plant: ReducedPlant) -> reduced.ReducedModel:
    if isinstance(plant, EquationsPhysics):
        raise ValueError('a linear model is needed: set reduced.source = "mjcf"')
    return plant.model


def _parameters(design: Design, table: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a law; a table becomes the dataclass that the design takes."""
    known = parameters_of(design)
    return {
        key: TypeAdapter(known[key].annotation).validate_python(value)
        if is_dataclass(known[key].annotation)
        else value
        for key, value in table.items()
        if key not in ("law", "modulation")
    }


def reduced_plant(scenario: Scenario, machine: Spacecraft, full: MujocoPhysics) -> ReducedPlant:
    """Builds the reduced plant with the inputs of the full one.

    Args:
        scenario: For the source and the number of modes.
        machine: The spacecraft.
        full: The full plant.

    Raises:
        ValueError: If the machine has no such reduced model.
    """
    if scenario.reduced.source == "equations":
        return EquationsPhysics(
            machine,
            disturbances=[n for n in full.inputs if n.startswith("disturbance_")],
            timestep=scenario.simulation.timestep,
        )
    model, modes = full.model.ptr, scenario.reduced.modes
    linear = linearize.linearize_bus(model)
    wiring = mjcf.channels(machine, [n for n in full.inputs if n.startswith("disturbance_")])
    B = linear.B @ [[a in actuators for actuators in wiring.values()] for a in linear.actuators]
    if scenario.reduced.source == "galerkin":
        if modes == 0:
            raise ValueError(
                "reduced.modes = 0: a Galerkin model has at least one mode; set reduced.modes = 1, "
                'or reduced.source = "mjcf"'
            )
        inertia, radius, boom = linearize.planar_bus(model, machine)
        coefficients = beam.galerkin(
            bus_inertia=inertia,
            root_radius=radius,
            length=boom.length,
            linear_density=boom.linear_density,
            bending_stiffness=boom.bending_stiffness,
            damping_time=boom.damping_time,
            n_modes=modes,
        )
        found = reduced.galerkin_model(
            coefficients,
            torques=dict(zip(wiring, B[linear.rigid[-1]].tolist(), strict=True)),
            tips={boom.name: boom.length for boom in machine.booms},
        )
        start = reduced.galerkin_start(modes)
    else:
        found = reduced.truncate(
            M=linear.M, D=linear.D, K=linear.K, B=B, C=linear.C, y0=linear.y0,
            outputs=linear.outputs, inputs=full.inputs, rigid=linear.rigid, modes=modes,
        )  # fmt: skip

        start = partial(linearize.initial_state, model, machine)

    return reduced.ReducedPhysics(found, start=start, timestep=scenario.simulation.timestep)


def parameters_of(law: Design) -> dict[str, inspect.Parameter]:
    """Returns the parameters of a design that a scenario sets, by name.

    Args:
        law: The design function.
    """
    found = inspect.signature(law, eval_str=True).parameters
    return {name: p for name, p in found.items() if p.kind is inspect.Parameter.KEYWORD_ONLY}


def _part_faults(table: config.Table) -> list[str]:
    """Names of booms and thrusters that the spacecraft does not have."""
    try:
        machine = spacecraft.load(table.get("spacecraft", ""))
    except ValueError:
        return []  # said when the machine is loaded
    found, actual = [], table.get("actual")
    for prefix, owner in (("", table), ("actual.", actual if isinstance(actual, dict) else {})):
        for kind, parts in (("booms", machine.booms), ("thrusters", machine.thrusters)):
            known = [*(part.name for part in parts), "all"]
            changes = owner.get(kind)
            for name in changes if isinstance(changes, dict) else ():
                if name not in known:
                    text = choices(kind[:-1], name, known, where=machine.name)
                    found.append(f"  {prefix}{kind}.{name}: {text}")
    return found


def _controller_faults(table: Any, laws: Mapping[str, Design]) -> list[str]:
    """Faults of a scenario's controller table against the signature of its law's design."""
    if not isinstance(table, dict):
        return []  # the scenario's own validation says so
    law = str(table.get("law"))
    if law not in laws:
        return [f"  controller.law: {choices('law', law, laws, where='the registry')}"]
    fields: dict[str, Any] = {
        name: (
            Any if p.annotation is p.empty else p.annotation,
            ... if p.default is p.empty else p.default,
        )
        for name, p in parameters_of(laws[law]).items()
    }
    fields |= {"law": (str, ...), "modulation": (Modulation, None)}
    model = create_model("controller", __base__=config.Model, **fields)
    return config.faults(model, table, prefix="controller.")
