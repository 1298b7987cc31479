"""Every benchmark, one after the other (about an hour on two cores); figures go to benchmarks/results.

The paper's experiments take hours: they are only judged anew here (`paper.py EXPERIMENT` makes their runs).
"""

import subprocess
import sys
from pathlib import Path

for name in (
    "rates", "time_to_criterion", "success", "runtime_speed", "c_export", "onboard", "msp_fuzz", "log_fuzz",
    "sim_to_sim", "firmware_flights",
    "firmware_faults", "command_flights", "controllers", "fault_campaign", "process_faults", "bridge_loop", "rendering",
    "mesh_rendering", "expert", "visual_tasks", "ablation", "stable_baselines3_ppo", "thrown_starts", "thrown",
    "any_vehicle", "raptor", "identify", "step_response", "paper",
):  # fmt: skip
    print(f"== {name}", flush=True)
    subprocess.run([sys.executable, str(Path(__file__).parent / f"{name}.py")], check=True)
