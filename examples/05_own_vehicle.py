"""Your own vehicle: copy a TOML file and change the values that differ. Mistakes are reported by name."""

import tempfile
from importlib import resources
from pathlib import Path

from e2efly.vehicles.loading import load_vehicle

text = (resources.files("e2efly.vehicles") / "vis_r.toml").read_text()
with tempfile.TemporaryDirectory() as folder:
    mine = Path(folder) / "mine.toml"
    mine.write_text(text.replace("value = 0.75\n", "value = 0.90\n", 1))
    vehicle = load_vehicle(mine)
    print(f"{vehicle.name}: {vehicle.mass} kg, thrust to weight {vehicle.thrust_to_weight:.2f}, hash {vehicle.hash}")
    mine.write_text(text.replace("value = 0.75\n", "value = 7.5\n", 1))
    try:
        load_vehicle(mine)
    except ValueError as error:
        print("refused:", error)
