"""`e2efly airsim-settings`: AirSim's settings.json for a vehicle."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from e2efly.commands.terminal import Terminal, headed
from e2efly.config.storage import write_json


@dataclass(frozen=True)
class AirsimSettings:
    """Write AirSim's settings.json for a vehicle, and list what these settings cannot express about the vehicle."""

    vehicle: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="[VEHICLE]")]] = "vis_r"
    """Name of a vehicle, or a .toml file."""
    policy: Path | None = None
    """A run directory, a policy.onnx, or a task of the zoo. The cameras of this policy are written, too."""
    out: Path = Path("settings.json")
    """The file to write. AirSim reads Documents/AirSim/settings.json."""
    port: int = 41451
    """Port on which AirSim listens, for connections from its own machine only."""


def run(options: AirsimSettings) -> int:
    """Write the file.

    Raises:
        ValueError: for an unknown vehicle or policy, or an invalid port. Nothing is written then.
    """
    from e2efly.policy.loader import load_policy
    from e2efly.policy.zoo import policy_file
    from e2efly.validation.airsim.settings_file import named, settings, unsaid
    from e2efly.vehicles.loading import load_vehicle
    from e2efly.vehicles.vehicle_rules import check_quadrotor

    if not 1 <= options.port <= 65535:
        raise ValueError(f"--port is {options.port}; accepted: 1 to 65535")
    vehicle = load_vehicle(options.vehicle)
    check_quadrotor(vehicle, "AirSim")
    images = ()
    if options.policy is not None:
        images = load_policy(policy_file(options.policy, options.vehicle)).contract.images
    console = Terminal()
    write_json(options.out, settings(vehicle, images, options.port))
    console.print(f"Settings: {options.out}")
    for option in named(images):
        console.print(f"Its camera in `e2efly validate --plant airsim`: {option}")
    table = headed("what settings.json cannot say", vehicle.name, "where AirSim has it")
    for row in unsaid(vehicle, images):
        table.add_row(*row)
    console.print(table)
    console.print(
        "AirSim flies its own numbers unless its source is changed in these places; `e2efly validate` measures what it "
        "flies and names the differences.",
        style="dim",
    )
    return 0
