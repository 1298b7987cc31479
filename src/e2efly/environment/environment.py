"""The one environment, for every task and algorithm: pure `reset` and `step`, batched over one leading axis.

A control step has these parts, in this order. The action joins the latency queue. The physics runs its sub-steps with
the commands that leave the queue. The task judges the result. The reward is summed. The policy's observation is built
from the (delayed, noisy) state. Vehicles whose episode ended start again. Their cameras render. All of it is
differentiable, except the events and the images.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.config import (
    CameraConfig,
    DisturbanceConfig,
    EnvConfig,
    EstimateConfig,
    ImuConfig,
    LinkConfig,
    NoiseConfig,
    PayloadConfig,
    RewardConfig,
    TaskConfig,
)
from e2efly.config.env import FILE, RANDOM, STILL
from e2efly.control import COMMAND_MODES
from e2efly.environment import air, disturbance, expert, lost_commands, lost_rotor, payloads, pose_errors
from e2efly.environment.camera_images import newest
from e2efly.environment.draws import between, delays, deviations, perturbed
from e2efly.environment.env_state import (
    DISTURBED,
    ESTIMATED,
    INERTIAL,
    SEEN,
    SENT,
    STARTS,
    EnvState,
    Step,
    pushed,
    where,
)
from e2efly.environment.limits import latencies_of, limits_of, nominal_latency, posterior_of
from e2efly.environment.privileged import OTHER_SIZE, SCENE_SIZE, of_others, of_scene
from e2efly.environment.rules import check, hidden
from e2efly.environment.signals import dangers, happened
from e2efly.policy.goal import Goal
from e2efly.policy.observation import OWN, Field, Known, Own, own_fields
from e2efly.simulation import rewards
from e2efly.simulation.physics import Physics, State, started, step
from e2efly.simulation.physics.body import hover_rotor_speed
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors import imu, latency
from e2efly.simulation.sensors.eyes import Eye, image_shape, steady
from e2efly.simulation.sensors.noise import add_noise
from e2efly.tasks.task import Guided, Shape, Task, into_ball, make_task, uniform
from e2efly.vehicles.family import Family, load_family
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import IDENTIFIED, Posterior
from e2efly.vehicles.vehicle import Flown

DEFAULT = EnvConfig()
"""The VIS-R; only the starts are random."""


def _times(part: Any, strength: float) -> Any:
    """The numbers of a configuration times a share, except the gusts' correlation time, which is no strength."""
    scaled = {name: strength * value for name, value in vars(part).items() if name != "gust_time"}
    return dataclasses.replace(part, **scaled)


def _flown_task(config: TaskConfig, shape: Shape, physics: Physics) -> Task:
    """The checked task of a vehicle."""
    config.check(1 / physics.control_period, shape.feet_height)
    return make_task(config, shape, physics.control_period, physics.substeps)


@partial(
    jax.tree_util.register_dataclass,
    data_fields=[
        "physics", "task", "weights", "parameters", "center", "half", "hover", "latency_range",
        "observation_latency_range", "randomize", "posterior", "wind", "downwash", "cushion", "lost_rotor",
        "lost_rotor_time", "disturbance", "estimate", "link", "noise", "payload", "imu", "cameras",
    ],
    meta_fields=["queue", "seen_actions", "past", "family", "central", "unseen"],
)  # fmt: skip
@dataclass(frozen=True)
class Env:
    """Make it with `Env.of`. Its numbers are leaves: pass it to compiled functions, replace them freely."""

    physics: Physics
    task: Task
    weights: dict[str, Any]
    parameters: dict[str, Any]
    center: Float[Array, " c"]
    """Command at action 0, of the nominal vehicle."""
    half: Float[Array, " c"]
    """Half of the command's range."""
    hover: Float[Array, " c"]
    """The action with which a level vehicle hovers, if the command mode has one. Otherwise the middle of the range."""
    latency_range: Float[Array | np.ndarray, "2"]
    observation_latency_range: Float[Array | np.ndarray, "2"]
    randomize: dict[str, Any]
    """Relative half-width of each randomised vehicle parameter."""
    posterior: Posterior | None
    """The distribution from which an identified vehicle is drawn. None: the vehicle is not drawn."""
    wind: Any
    """Largest wind speed, m/s; None: still air."""
    downwash: Any
    """See `EnvConfig`; None: there is none."""
    cushion: Any
    """See `EnvConfig`; None: there is none."""
    lost_rotor: Any
    """Probability that an episode loses a rotor; None: none does."""
    lost_rotor_time: Float[Array | np.ndarray, "2"] | None
    """Earliest and latest time of that, s; None likewise."""
    disturbance: DisturbanceConfig | None
    estimate: EstimateConfig | None
    link: LinkConfig | None
    noise: NoiseConfig | None
    payload: PayloadConfig | None
    imu: ImuConfig | None
    cameras: tuple[CameraConfig, ...]
    queue: int
    """Number of actions that are kept."""
    seen_actions: int
    """Number of past actions in the observation."""
    past: int
    """Number of states that are kept for delayed observations and images. 0: none."""
    family: Family | None = None
    """The family, if every episode has a different vehicle, which its flight controller knows. `physics` holds the
    middle one."""
    central: bool = False
    """See `EnvConfig.central_critic`."""
    unseen: tuple[str, ...] = ()
    """Names of the vehicle's own fields (`e2efly.policy.observation.OWN`) that are not observed."""

    @staticmethod
    def of(
        task: TaskConfig,
        reward: RewardConfig,
        config: EnvConfig = DEFAULT,
        dtype: type = np.float32,
        flown: Flown | None = None,
    ) -> "Env":
        """Build the environment of a configuration.

        Args:
            task: the options of the task.
            reward: the reward.
            config: the configuration. Its vehicle gives the limits of the commands, the control rate and the latency.
            dtype: the type of all numbers.
            flown: the vehicle that flies, and the one that the flight controller assumes. None: both are the
                configuration's vehicle. If that is a family, every episode draws a vehicle.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        family = load_family(config.vehicle)
        vehicle = load_vehicle(config.vehicle) if family is None else family.middle
        physics = Physics.of(
            vehicle, config.command_mode, config.integrator, config.control_rate, config.largest_step, dtype
        )
        period, body = physics.control_period, vehicle
        if flown is not None:
            body, believed = flown.body, flown.believed
            physics = Physics.of(
                believed, config.command_mode, config.integrator, config.control_rate, config.largest_step, dtype
            )
            physics = physics if flown.as_believed else physics.flying(body, dtype)
        posterior = posterior_of(config)
        check(config, vehicle, family, body, posterior)
        rewards.check(reward.weights, reward.parameters)
        late = config.action_latency or latencies_of(config, body, family if flown is None else None, posterior)
        frames = latency.frames(late[1], period)
        seen = frames if config.past_actions is None else config.past_actions
        mode, (low, high) = COMMAND_MODES[config.command_mode], limits_of(config, vehicle, family)
        noisy = config.noise != NoiseConfig()
        shape = Shape(body.feet_height, body.radius)
        oldest = max(config.observation_latency[1], *(camera.latency[1] for camera in config.cameras), 0.0)
        flown_task = _flown_task(task, shape, physics)
        named = task.observes or ()
        felt = config.imu.observed or any(row.source == "imu" and row.field.name in named for row in OWN)
        mine = own_fields(imu=felt, actions=seen, size=len(low))
        unseen = hidden(task, flown_task, [row.field for row in mine])
        if getattr(flown_task, "agents", 1) == 1:
            for name, off in (("downwash", 0), ("central_critic", False)):
                if value := getattr(config, name):
                    raise ValueError(
                        f"env.{name} is {value}; accepted: {off}, as a world of {task.name} has one vehicle"
                    )
        return Env(
            physics=physics,
            task=flown_task,
            weights=dict(reward.weights),
            parameters=dict(reward.parameters),
            center=((low + high) / 2).astype(dtype),
            half=((high - low) / 2).astype(dtype),
            hover=((np.asarray(mode.hover(vehicle)) - low) / (high - low) * 2 - 1).astype(dtype),
            latency_range=np.asarray(late, dtype),
            observation_latency_range=np.asarray(config.observation_latency, dtype),
            randomize={name: width for name, width in config.randomize.items() if name != IDENTIFIED},
            posterior=posterior and dataclasses.replace(posterior, root=posterior.root.astype(dtype)),
            wind=config.wind or None,
            downwash=config.downwash or None,
            cushion=config.cushion or None,
            lost_rotor=config.lost_rotor or None,
            lost_rotor_time=np.asarray(config.lost_rotor_time, dtype) if config.lost_rotor else None,
            disturbance=None if config.disturbance == DisturbanceConfig() else config.disturbance,
            estimate=None if config.estimate == EstimateConfig() else config.estimate,
            link=None if config.link == LinkConfig() else config.link,
            noise=config.noise if noisy else None,
            payload=config.payload if config.payload.mass[1] else None,
            imu=config.imu if felt else None,
            cameras=config.cameras,
            queue=max(frames + 1, seen, 2),
            seen_actions=seen,
            past=latency.frames(oldest, period) + 1 if oldest else 0,
            family=family if flown is None else None,
            central=config.central_critic,
            unseen=unseen,
        )

    def on(self, task: TaskConfig) -> "Env":
        """The same vehicle, air, sensors and reward with other options of a task: another criterion or stage."""
        return dataclasses.replace(self, task=_flown_task(task, self.task.shape, self.physics))

    @property
    def episode_steps(self) -> int:
        """Control steps of the longest episode."""
        return int(np.ceil(float(self.task.episode_s) / self.control_period - 1e-6))

    @property
    def is_disturbed(self) -> bool:
        """Whether episodes have vehicles, delays, air or cameras that differ from those of the files."""
        sooner, later = self.latency_range
        spread = sooner != later and self.family is None
        spread = spread or any(camera != steady(camera) for camera in self.cameras)
        drawn = any(self.randomize.values()) or (self.posterior is not None and np.any(self.posterior.root))
        parts = (self.disturbance, DisturbanceConfig()), (self.estimate, EstimateConfig()), (self.link, LinkConfig())
        happens = self.wind or self.downwash or self.cushion or self.lost_rotor
        return bool(spread or drawn or happens or any((part or none) != none for part, none in parts))

    @property
    def vehicles(self) -> str:
        """The name of what flies, for everything that tells a success."""
        if self.is_disturbed:
            return RANDOM
        return FILE if self.family is None else STILL

    def undisturbed(self) -> "Env":
        """The environment with the vehicle of the file, its delay, still air, exact poses, and nominal cameras.

        For a family, it has the family's vehicles and their delays. Only numbers differ, so the same compiled programs
        accept it.
        """
        return dataclasses.replace(self.eased(0.0), cameras=tuple(map(steady, self.cameras)))

    def eased(self, strength: float) -> "Env":
        """The environment with a share of all that is drawn, except the cameras: only numbers differ."""
        late = np.stack([self.latency + strength * (x - self.latency) for x in self.latency_range])
        return dataclasses.replace(
            self,
            latency_range=late.astype(self.latency_range.dtype) if self.family is None else self.latency_range,
            randomize={name: strength * width for name, width in self.randomize.items()},
            posterior=self.posterior and self.posterior.times(strength),
            wind=self.wind and strength * self.wind,
            downwash=self.downwash and strength * self.downwash,
            cushion=self.cushion and strength * self.cushion,
            lost_rotor=self.lost_rotor and strength * self.lost_rotor,
            disturbance=self.disturbance and _times(self.disturbance, strength),
            estimate=self.estimate and _times(self.estimate, strength),
            link=self.link and _times(self.link, strength),
            noise=self.noise and _times(self.noise, strength),
        )

    @property
    def fields(self) -> tuple[Field, ...]:
        """The observation, field by field."""
        return (*self.task.fields, *(row.field for row in self._own))

    @property
    def _own(self) -> tuple[Own, ...]:
        rows = own_fields(imu=self.imu is not None, actions=self.seen_actions, size=self.action_size)
        return tuple(row for row in rows if row.field.name not in self.unseen)

    def showing(self, names: Sequence[str]) -> "Env":
        """The same environment, with an observation of only those fields that have these names."""
        own_options = isinstance(self.task, Goal) and isinstance(self.task.config, TaskConfig)
        task = self.task.shown_to(names) if isinstance(self.task, Goal) and own_options else self.task
        every = dataclasses.replace(self, unseen=())._own
        return dataclasses.replace(
            self, task=task, unseen=tuple(row.field.name for row in every if row.field.name not in names)
        )

    @property
    def observation_size(self) -> int:
        """Number of entries of the observation."""
        return sum(f.size for f in self.fields)

    @property
    def control_period(self) -> float:
        """Duration of a control step, s."""
        return self.physics.control_period

    @property
    def latency(self) -> float:
        """Latency from observation to command of the vehicle of the file, s."""
        own: Any = self.physics.flown.latency
        return nominal_latency(float(own), (float(self.latency_range[0]), float(self.latency_range[1])))

    @property
    def agents(self) -> int:
        """Number of vehicles in a world: rows of the batch that are next to each other."""
        return int(getattr(self.task, "agents", 1))

    def whole(self, n: int, parts: int = 1) -> int:
        """The smallest number of vehicles from n on that makes equally many whole worlds in each of some parts."""
        each = self.agents * parts
        return -(-n // each) * each

    def is_over(self, time: Float[Array, " n"]) -> Bool[Array, " n"]:
        """Whether the time of an episode is over, at a time since its start, s."""
        return time >= self.task.episode_s - 1e-3 * self.control_period

    def command(self, action: Float[Array, "n c"]) -> Float[Array, "n c"]:
        """The nominal action map: linear from [-1, 1] to the command's range, and clipped to it."""
        return self.center + self.half * jnp.clip(action, -1.0, 1.0)

    def reset(self, key: PRNGKeyArray, n: int) -> tuple[EnvState, Float[Array, "n o"]]:
        """Start `n` episodes.

        Returns:
            The state and the first observation.

        Raises:
            ValueError: for a number of vehicles that is not that of whole worlds.
        """
        if n % self.agents:
            raise ValueError(f"n is {n} vehicles; accepted: a multiple of {self.agents}, the vehicles of a world")
        state = self._start(key, n, jnp.zeros((), jnp.int32))
        return self.look(state, jnp.ones(n, bool)), self._observe(state)

    def step(
        self, state: EnvState, action: Float[Array, "n c"], *, restart: bool = True, privileged: bool = False
    ) -> tuple[EnvState, Step]:
        """One control step.

        Args:
            state: the state from `reset` or from the previous step.
            action: in [-1, 1]. Values outside are clipped.
            restart: whether to start a new episode where one ended. Otherwise the ended episode continues.
            privileged: fill `Step.final_privileged`, for a critic.

        Returns:
            The state to act on next, and what happened.
        """
        reached, out = self._advance(state, action)
        if privileged:
            out = dataclasses.replace(out, final_privileged=self.privileged(reached))
        if not restart:
            return self.look(reached, jnp.zeros_like(out.terminated)), out
        reached, out = self._restart(reached, out)
        return self.look(reached, out.done), out

    def look(self, state: EnvState, renewed: Bool[Array, " n"], world: Scene | MeshScene | None = None) -> EnvState:
        """The state with the images that are available to act on.

        Cameras whose next image is due render a new image, and so do the cameras of vehicles whose episode is new.

        Args:
            state: the state of the vehicles, with the images so far.
            renewed: which vehicles have a new episode.
            world: what is seen in place of the task's worlds: n worlds, or one world of triangles for all vehicles.
        """
        if not self.cameras:
            return state
        scene = self.task.scene(jax.lax.stop_gradient(state.memory)) if world is None else world
        return dataclasses.replace(state, images=newest(self.cameras, scene, state, renewed, self.control_period))

    @property
    def action_size(self) -> int:
        """Number of entries of an action: four, or one for each rotor in the modes of rotor thrusts."""
        return len(self.hover)

    @property
    def privileged_size(self) -> int:
        """Number of entries of `privileged`."""
        return SCENE_SIZE * bool(self.cameras) + OTHER_SIZE * (self.agents - 1) * self.central

    def privileged(self, state: EnvState) -> Float[Array, "n p"]:
        """What a critic may know in addition to the observation: the true scene if there are cameras, and the motion of
        all others of the world if the critic is central.
        """
        parts = [jnp.zeros((state.time.shape[0], 0))]
        parts += [of_scene(self.task, state)] if self.cameras else []
        parts += [of_others(state.vehicle, self.agents)] if self.central else []
        return jnp.concatenate(parts, axis=-1)

    def _restart(self, state: EnvState, out: Step) -> tuple[EnvState, Step]:
        """Start a new episode where `out` says that the episode ended."""

        def anew(_: None) -> tuple[EnvState, Array]:
            fresh = self._start(state.key_of(STARTS), out.reward.shape[0], state.tick)
            chosen = where(out.done, dataclasses.replace(fresh, key=state.key), state)
            return chosen, self._observe(chosen)

        state, observation = jax.lax.cond(jnp.any(out.done), anew, lambda _: (state, out.final_observation), None)
        return state, dataclasses.replace(out, observation=observation)

    def _advance(self, state: EnvState, action: Float[Array, "n c"]) -> tuple[EnvState, Step]:
        """One control step without new starts, with the images of the previous step."""
        period = self.control_period
        actions = jnp.concatenate([action[:, None], state.actions[:, :-1]], axis=1)
        linked = state.link and state.link.after(state.key_of(SENT), action, state.time)
        arrived = actions if linked is None else jnp.asarray(linked.arrived)
        old, new, switch = latency.acting_commands(self.command(arrived), state.action_latency, period)
        before, physics = state.vehicle, self._physics(state.family)
        plant = dataclasses.replace(physics.flown, **state.plant)
        wind, share, push, disturbed = state.wind, None, None, state.disturbance
        if disturbed is not None:
            gust = jnp.asarray(disturbed.gust)
            wind = gust if wind is None else wind + gust
            share, push = disturbed.share(state.time / self.task.episode_s), jnp.asarray(disturbed.push)
            plant = disturbed.weaker(plant, physics.nominal, physics.mixer.thrust_max)
            physics = disturbed.mixed(physics)
            disturbed = disturbance.advance(disturbed, state.key_of(DISTURBED), period)
        if state.lost_rotor is not None:
            plant = state.lost_rotor.weaker(plant, state.time)
        if self.downwash is not None:
            blown = self.downwash * air.downwash(air.Jet.of(physics.nominal), before, self.agents)
            wind = blown if wind is None else wind + blown
        if self.cushion is not None:
            more = air.cushion(air.propeller(physics.nominal), before.position[:, 2]) - 1
            lifted = jnp.broadcast_to((1 + self.cushion * more)[:, None], before.rotor_speed.shape)
            share = lifted if share is None else share * lifted
        after = step(
            physics, plant, before, new, previous=old, switch_time=switch, wind=wind, rotor_share=share, push=push
        )

        time = (jnp.round(state.time / period) + 1) * period  # whole periods: float32 sums drift
        late = self.is_over(time)
        memory, outcome = self.task.advance(state.memory, before, after, time, late)
        inertial = state.imu
        if self.imu is not None and inertial is not None:
            inertial = imu.measure(self.imu, state.key_of(INERTIAL), inertial, before, after, period)
        reached = dataclasses.replace(
            state,
            vehicle=after,
            memory=memory,
            time=time,
            actions=actions,
            disturbance=disturbed,
            link=linked,
            past=None if state.past is None else pushed(state.past, dataclasses.replace(after, load=None)),
            imu=inertial,
            tick=state.tick + 1,
        )
        if state.estimate is not None:
            found = state.estimate.after(state.key_of(ESTIMATED), self._measured(reached), period)
            reached = dataclasses.replace(reached, estimate=found)
        signals = happened(self.task, state, reached, action, outcome)
        if self._reads("expert_action") and isinstance(self.task, Guided) and physics.command_mode == "ctbr":
            signals["expert_action"] = self.expert_action(state)
        if self._reads("clearance", "gaps"):
            signals |= dangers(self.task, memory, after, time)
        total, terms = rewards.reward(self.weights, self.parameters, signals)
        observation = self._observe(reached)
        return reached, Step(
            observation=observation,
            final_observation=observation,
            reward=total,
            terms=terms,
            terminated=outcome.terminated,
            truncated=late & ~outcome.terminated,
            success=outcome.success,
            error=outcome.error,
        )

    def _start(self, key: PRNGKeyArray, n: int, tick: Int[Array, ""]) -> EnvState:
        task_key, plant_key, wind_key, action_key, observation_key, eyes_key, onward = jax.random.split(key, 7)
        family = None
        if self.family is not None:
            family = jax.random.uniform(jax.random.fold_in(plant_key, 2), (n, self.family.drawn), self.center.dtype)
        flown = self._physics(family).flown
        disturbed, known = None, dict[str, Any]()
        if self.posterior is None:
            late = between(action_key, n, self.latency_range)
        else:
            deviation = deviations(jax.random.fold_in(plant_key, 3), n, self.posterior, self.center.dtype)
            known = self.posterior.values(self.physics.flown, deviation)
            nominal = self.physics.flown.latency
            late = delays(action_key, self.latency_range, nominal, self.posterior, deviation)
        about = dataclasses.replace(flown, **known)
        plant = known | perturbed(plant_key, n, self.physics.flown, self.randomize, about)
        if self.disturbance is not None:
            disturbed_key, mass_key = jax.random.split(jax.random.fold_in(plant_key, 1))
            disturbed = disturbance.draw(self.disturbance, disturbed_key, n, flown.rotor_count)
            rotors: Any = plant.get("rotor_position", flown.rotor_position)
            offset = self.disturbance.centre_of_mass * uniform(mass_key, n, 2)[:, None]
            if self.family is not None:  # in proportion to the size
                middle = self.physics.flown
                offset = offset * (
                    jnp.abs(flown.rotor_position / middle.rotor_position)
                    if flown.rotor_axis is None
                    else (flown.radius / middle.radius)[:, None, None]
                )
            plant["rotor_position"] = rotors - disturbance.level(offset, rotors)
        lost = None
        if self.lost_rotor is not None and self.lost_rotor_time is not None:
            lost_key = jax.random.fold_in(plant_key, 5)
            lost = lost_rotor.draw(self.lost_rotor, self.lost_rotor_time, lost_key, n, flown.rotor_count)
        dtype = self.center.dtype
        vehicle, memory = self.task.start(task_key, n)
        rotor_speed = jnp.broadcast_to(jnp.asarray(hover_rotor_speed(flown))[..., None], (n, flown.rotor_count))
        vehicle = dataclasses.replace(vehicle, rotor_speed=rotor_speed)
        vehicle = jax.tree.map(lambda x: x.astype(dtype), started(self.physics, flown, vehicle))
        past = None
        if self.past:  # no observation shows the load
            past = jax.tree.map(lambda x: jnp.broadcast_to(x[:, None], (n, self.past, *x.shape[1:])), vehicle)
        if self.payload is not None:
            load = payloads.draw(self.payload, jax.random.fold_in(plant_key, 4), vehicle, flown.mass)
            vehicle = dataclasses.replace(vehicle, load=load)
        actions = jnp.broadcast_to(self.hover, (n, self.queue, self.action_size)).astype(dtype)
        estimate_key, link_key = (jax.random.fold_in(observation_key, i) for i in (1, 2))
        return EnvState(
            vehicle=vehicle,
            memory=memory,
            time=jnp.zeros(n, dtype),
            actions=actions,
            action_latency=late,
            plant=plant,
            wind=None if self.wind is None else self.wind * into_ball(uniform(wind_key, n, 3)),
            family=family,
            disturbance=disturbed,
            lost_rotor=lost,
            estimate=None if self.estimate is None else pose_errors.draw(self.estimate, estimate_key, vehicle),
            link=None if self.link is None else lost_commands.draw(self.link, link_key, actions),
            past=past,
            observation_latency=between(observation_key, n, self.observation_latency_range),
            imu=None if self.imu is None else imu.ImuState.at(vehicle),
            eyes=tuple(Eye.of(c, jax.random.fold_in(eyes_key, i), n) for i, c in enumerate(self.cameras)),
            images=tuple(jnp.zeros((n, *image_shape(camera))) for camera in self.cameras),
            key=onward,
            tick=tick,
        )

    def _physics(self, family: Float[Array, "n u"] | None) -> Physics:
        """The physics of each episode's vehicle."""
        if self.family is None or family is None:
            return self.physics
        return self.physics.of_each(self.family.draw(family))

    def _reads(self, *signals: str) -> bool:
        """Whether a reward term reads one of these signals."""
        return any(signal in rewards.TERMS.find(name).inputs for name in self.weights for signal in signals)

    def expert_action(self, state: EnvState) -> Float[Array, "n c"]:
        """The action of an expert that knows the whole world and this vehicle. It has no gradient.

        For tasks that have an `expert`, and for commands of thrust and body rates.
        """
        assert isinstance(self.task, Guided)
        state = jax.lax.stop_gradient(state)
        physics = self._physics(state.family)
        vehicle = physics.nominal
        known = {name: state.plant[name] for name in ("rate_gain", "motor_time_constant") if name in state.plant}
        flown = dataclasses.replace(vehicle, **known)
        progress = state.time / self.task.episode_s
        share = (
            jnp.ones((len(progress), vehicle.rotor_count))
            if state.disturbance is None
            else state.disturbance.share(progress)
        )
        effect = expert.CommandEffect.of(flown, state.plant, share)
        queue = effect.given(self.command(state.actions))
        motion = expert.ahead(flown, state.vehicle, queue, state.action_latency, self.control_period)
        largest = jnp.minimum((self.center + self.half)[0], vehicle.lift * physics.mixer.thrust_max / vehicle.mass)
        pilot = expert.pilot(flown, largest * effect.thrust)
        velocity, yaw = self.task.expert(state.memory, expert.flier(pilot, motion, state.time + state.action_latency))
        command = effect.needed(expert.command(pilot, motion, velocity, yaw))
        return jnp.clip((command - self.center) / self.half, -1.0, 1.0)

    def _measured(self, state: EnvState) -> State:
        """The state that is measured: the vehicle's, or an older one."""
        if state.past is None:
            return state.vehicle
        return latency.delayed_state(state.past, state.observation_latency, self.control_period)

    def _observe(self, state: EnvState) -> Float[Array, "n o"]:
        return self.shown(state, self.sensed(state))

    def sensed(self, state: EnvState) -> State:
        """The motion that is observed of a state, with its age and its errors."""
        seen = self._measured(state)
        if state.estimate is not None:
            seen = state.estimate.shown(seen)
        if state.disturbance is not None:
            seen = dataclasses.replace(seen, position=seen.position + state.disturbance.drift)
        if self.noise is not None:
            seen = add_noise(self.noise, state.key_of(SEEN), seen)
        return seen

    def shown(self, state: EnvState, seen: State) -> Float[Array, "n o"]:
        """The observation of a state whose observed motion is `seen`."""
        known = Known(seen, state.imu, state.actions[:, : self.seen_actions])
        own = (row.value(known) for row in self._own)
        return jnp.concatenate([self.task.observe(state.memory, state.time, seen), *own], axis=-1)
