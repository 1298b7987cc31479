"""The picture of docs/eyes.md: a race by a camera and an IMU alone, as it was and as the vehicle believed it to be."""

import dataclasses
import math
from pathlib import Path

import numpy as np

from e2efly.config.drawing import INK
from e2efly.flight.sight.gate_corners import gate_corners
from e2efly.policy.loader import load_policy
from e2efly.policy.runtime import Runtime
from e2efly.policy.zoo import policy_file
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.route import course_for, usual_route
from e2efly.validation.gate_pose import GateCamera, GatePose, track_of
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import flying, together
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.style import BLUE, GREY, VERMILLION, figure

SEED, MOMENT = 8, 4.2
"""Of the flight, and the time of the image, s."""


def main() -> None:
    """Fly three laps on MuJoCo and draw them."""
    compute_at_once()
    prepare("cpu")
    policy, vehicle = load_policy(policy_file("race", "vis_r")), load_vehicle("vis_r")
    route = dataclasses.replace(usual_route(policy.contract), laps=3, outside=True)
    course = course_for(policy.contract, vehicle, route)
    track = track_of(course)
    half = track.start_yaw / 2
    start = RigidState(track.start, np.zeros(3), np.array([math.cos(half), 0, 0, math.sin(half)]), np.zeros(3))
    pose = GatePose.of(GateCamera(), course, start, SEED)
    runtime = Runtime.of(policy, course, vehicle, imu=True)
    plant = find_plant("mujoco").of(vehicle, policy.contract)
    images, doubt, times = [], [], []
    seen, step = pose.eyes._image, pose.step

    def looking(exposed: float) -> np.ndarray:
        images.append((exposed, seen(exposed)))
        return images[-1][1]

    def stepped(after: RigidState, now: float) -> None:
        step(after, now)
        times.append(now)
        doubt.append(float(np.sqrt(np.trace(pose.estimator.state.covariance[:3, :3]))))

    pose.eyes._image, pose.step = looking, stepped  # type: ignore[method-assign]
    (flown,) = together([flying(runtime, plant, start, 15.0, vehicle.latency, pose=pose)])
    assert flown.estimate is not None
    speed = np.linalg.norm(np.diff(flown.position, axis=0), axis=1).sum() / flown.time[-1]
    note = f"zoo policy race on MuJoCo, told its place by gates alone; {speed:.1f} m/s on average"
    with figure(Path(__file__).with_name("eyes.png"), "A race by a camera and an IMU", 4.4, [note]) as fig:
        axes = fig.subplot_mosaic([["way", "image"], ["way", "error"]], width_ratios=(1.1, 1))
        way = axes["way"]
        for corners in track.corners:
            way.plot(corners[[0, 1], 0], corners[[0, 1], 1], color=INK, lw=4, solid_capstyle="butt")
        way.plot(*flown.position[:, :2].T, color=GREY, lw=2.5, label="flown")
        way.plot(*flown.estimate[:, :2].T, color=VERMILLION, lw=0.9, label="believed")
        way.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        way.legend(loc="upper right")
        _, image = min(images, key=lambda each: abs(each[0] - MOMENT))
        axes["image"].imshow(1 - image, cmap="gray", vmin=-0.6, vmax=1)
        found = gate_corners(image).pixel - 0.5
        axes["image"].plot(*found.T, "o", color=VERMILLION, mfc="none", ms=6)
        axes["image"].set(xticks=[], yticks=[], title="what it sees, and the corners in it")
        axes["image"].grid(False)
        axes["error"].plot(times, 100 * np.array(pose.error), color=VERMILLION, lw=1, label="error")
        axes["error"].plot(times, 100 * np.array(doubt), color=BLUE, lw=1, label="standard deviation it expects")
        axes["error"].set(xlabel="time (s)", ylabel="cm", ylim=(0, None))
        axes["error"].legend(loc="upper right")


if __name__ == "__main__":
    main()
