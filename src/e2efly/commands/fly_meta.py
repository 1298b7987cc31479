"""What a flight log says of what flew."""

import dataclasses
import json
import platform
import sys
import time
from collections.abc import Sequence
from typing import Any

from e2efly import __version__
from e2efly.flight.bridge import Bridge
from e2efly.flight.log_record import Log
from e2efly.flight.pilot import throttle_map
from e2efly.flight.row import Row
from e2efly.vehicles.vehicle import Vehicle


def record_meta(
    log: Log, bridge: Bridge, body: Vehicle, contract: str, rows: Sequence[Row], flies: dict[str, Any]
) -> None:
    """Record what flies.

    Args:
        log: the log.
        bridge: the bridge, with the settings of the flight.
        body: the vehicle.
        contract: the contract of the policy, JSON. Empty: no policy flies.
        rows: the settings of the flight controller.
        flies: controller of the hover, file of the policy, and options of its goal.
    """
    settings = {
        **flies,
        "flight": dataclasses.asdict(bridge.settings),
        "controller": {row.setting: row.value for row in rows},
        "throttle_map": json.loads(throttle_map.as_json(bridge.map)),
    }
    versions = {
        "e2efly": __version__, "python": sys.version.split()[0], "machine": platform.platform(),
        **bridge.autopilot.versions,
    }  # fmt: skip
    log.record("meta", time.monotonic(), {
        "contract": contract, "vehicle": f"{body.name} {body.hash}", "settings": json.dumps(settings, default=str),
        "versions": json.dumps(versions),
    })  # fmt: skip
