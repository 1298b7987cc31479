"""Every benchmark, or those that are named, one after the other; figures go to benchmarks/results and to the pages.

    python benchmarks/run_all.py [NAME ...]
    python benchmarks/run_all.py times      # the times and rates of the README, and what stands beside them

All of them take most of a day on two cores. Those of trainings go on where they were when they are started again. The
paper's experiments take hours more: they are only judged anew here (`paper.py EXPERIMENT` makes their runs).
"""

import subprocess
import sys
from pathlib import Path

TIMES = ("time_to_criterion", "cold_start", "success", "paper", "rates", "rendering", "mesh_rendering")
OTHERS = (
    "many_vehicles", "moving_trunks",
    "rate_loop", "runtime_speed", "c_export", "onboard", "msp_fuzz", "log_fuzz", "policy_fuzz",
    "sim_to_sim", "firmware_flights", "firmware_vehicles",
    "firmware_faults", "command_flights", "controllers", "fault_campaign --publish", "process_faults", "bridge_loop",
    "mavlink", "crazyflie", "scorecards",
    "scorecards --vehicle crazyflie --flown policy --policies raptor any/hover_rotors any/hover",
    "expert", "visual_tasks", "ablation", "stable_baselines3_ppo", "thrown_starts", "thrown", "any_vehicle", "raptor",
    "multirotor", "eyes", "eyes --rows --flights 40", "eyes --firmware 5", "race_eyes",
    "gate_renders", "gate_masks --train 4850", "eyes --colours gates.onnx", "exchanges",
    "identify", "identify --plant structure --bare --first 1010", "step_response",
    "step_alignment", "step_alignment --plant betaflight --vehicles 6",
)  # fmt: skip
HERE = Path(__file__).parent

failed = []
asked = sys.argv[1:] or ["times", *OTHERS]
for name in (name for one in asked for name in (TIMES if one == "times" else (one,))):
    print(f"== {name}", flush=True)
    script, *options = name.split()
    if subprocess.run([sys.executable, str(HERE / f"{script}.py"), *options], check=False).returncode:
        failed.append(name)
for page in ("figures", "paper_page"):
    subprocess.run([sys.executable, str(HERE.parent / "docs" / f"{page}.py")], check=True)
if failed:
    sys.exit(f"failed: {', '.join(failed)}")
