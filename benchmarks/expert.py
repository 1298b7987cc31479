"""How the expert of avoid flies, which knows every trunk: success and speed, the bound of those who imitate it.

    python benchmarks/expert.py [--speeds 5 8 10] [--episodes 1000]

Nominal: the vehicle of the file. Robust: the vehicles, delays and air of the preset `robust`.
"""

import dataclasses
from typing import Any

import jax
from common import arguments, table, write

from e2efly.environment import Env, random_key
from e2efly.environment.episodes import EpisodesUnderWay, summary
from e2efly.runs.presets import preset
from e2efly.simulation.device import prepare


def flown(speed: float, nominal: bool, episodes: int) -> dict[str, Any]:
    """The summary of flights at one commanded speed, m/s."""
    config = preset("avoid", "bptt", "robust")
    task = dataclasses.replace(config.task, speed=(speed, speed), collisions_end=True)
    env = Env.of(task, config.reward, dataclasses.replace(config.env, cameras=()))
    env = env.undisturbed() if nominal else env
    steps = round(task.episode_s / env.control_period)

    @jax.jit
    def fly(env: Env) -> Any:
        def step(flight: EpisodesUnderWay, _: None) -> tuple[EpisodesUnderWay, None]:
            return flight.after(env, env.expert_action(flight.state), 0.0), None

        start = EpisodesUnderWay.of(*env.reset(random_key(1), episodes))
        return jax.lax.scan(step, start, None, length=steps)[0].episodes(env)

    return summary(fly(env))


def main() -> None:
    """Fly, print a table, write JSON."""
    options = arguments(__doc__ or "", speeds=[5.0, 8.0, 10.0], episodes=1000)
    prepare("cpu")
    rows = []
    for nominal in (True, False):
        for speed in options.speeds:
            found = flown(speed, nominal, options.episodes)
            rows.append(
                {
                    "vehicles": "nominal" if nominal else "robust",
                    "commanded, m/s": f"{speed:g}",
                    "success, %": f"{100 * found['success']:.1f}",
                    "mean speed, m/s": f"{found['mean_speed_m_s']:.2f}",
                    "time of a success, s": f"{found['seconds_of_success']:.2f}",
                }
            )
    write("expert", options.json, {"table": rows})
    print(table(rows))


if __name__ == "__main__":
    main()
