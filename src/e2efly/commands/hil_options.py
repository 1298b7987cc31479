"""Options of `e2efly hil` and of its rehearsal."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from e2efly.config import TaskConfig
from e2efly.validation.processes import Victim


@dataclass(frozen=True)
class Hil:
    """Put a real vehicle into a virtual world: render camera images at the poses that a motion capture system measures.

    At the same time, run `e2efly fly POLICY --image NAME=shm:...`: it reads the images and flies the policy. See
    docs/hil.md.
    """

    policy: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="POLICY")]]
    """The policy whose cameras and world are rendered: a policy.onnx, a run directory, or a task of the zoo."""
    pose: str = "udp:9870"
    """Pose source, as in `e2efly fly`."""
    image: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Where each image is sent: image_0=shm:NAME, tcp:PORT (tcp:PORT:exact: depth is not rounded to mm), ros1:/topic,
    ros2:/topic. May be repeated."""
    host: str = "127.0.0.1"
    """Address on which tcp images are served. 0.0.0.0 serves every computer of the network."""
    vehicle: str | None = None
    """A shipped vehicle or a .toml file. If omitted, the policy's vehicle."""
    seed: int = 0
    """Seed of the world."""
    task: TaskConfig = TaskConfig()
    """Options of the policy's task, which determine the world, as in `train` (--task.track my.toml, --task.speed 4 5,
    --task.clutter.obstacles 8). They replace the values from the policy's run or contract."""
    scene: str | None = None
    """Scene that is shown in place of the task's world: a scan or model (.glb, .gltf, .obj, .ply, .stl), a scene file
    (.toml), or warehouse, garage, terrain. The task's course stays the same."""
    scene_unit: float | None = None
    """Length unit of a scan's file, m (0.001: mm). If omitted, 1."""
    scene_up: Literal["y", "z"] | None = None
    """Axis of a scan's file that points up. If omitted, the one that the file's format defines."""
    scene_materials: bool = True
    """Use a scan's colours, materials and textures. Without them every object has the colour of its class, and their
    files may be missing."""
    beside: bool = False
    """Show the objects of the task's world (gates, trees, a pad) in addition to the scene."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Position of the origin of the world in the room, m; the same as --goal.origin of `e2efly fly`."""
    origin_yaw: float = 0.0
    """Angle from the room's x axis to the world's x axis, about the up axis, rad."""
    points: Path | None = None
    """A CSV file that replaces both: one row room_x,room_y,room_z,x,y,z for each point measured in the room, m."""
    fence_low: tuple[float, float, float] | None = None
    """Smallest x, y, z of the fence in the room, m. The same as --flight.fence.low of `e2efly fly`. A course that the
    fence does not hold is refused."""
    fence_high: tuple[float, float, float] | None = None
    """Largest x, y, z of the fence, m."""
    rate: float | None = None
    """Images per second. If omitted, the rate in the contract."""
    seconds: float | None = None
    """End after this time, s. If omitted, run until Ctrl-C."""
    track: Path = Path("flights") / "hil-track.toml"
    """File for the gates of a randomly drawn race, for --goal.track of `e2efly fly`. Other tasks write nothing."""
    watch: int | None = None
    """Port on 127.0.0.1 for a web page that shows the vehicle in the scene. A separate process serves it. See
    docs/watch.md."""
    record: Path | None = None
    """A new .mcap file with the images, their poses, latencies and virtual collisions."""
    report: Path | None = None
    """Folder for a histogram of the latencies, latency.png, and their numbers, latency.json."""
    json: Path | None = None
    """Write the measurements to this file at the end."""
    rehearse: bool = False
    """Rehearse the flight without hardware first. A simulated motion capture system, this command, `e2efly fly` and the
    real firmware run as separate processes, in real time. The options below are for the rehearsal only."""
    laps: int = 1
    """Number of flights of the rehearsal. Each flies in another world, starting with --seed."""
    kill: Victim | None = None
    """Kill one of the processes in each flight while the policy flies, to see what happens then."""
    pose_delay: float = 0.004
    """Delay of the poses in the rehearsal, s: that of the cameras and the network of your room."""
    link_delay: float | None = None
    """Delay of the commands from the bridge to the vehicle in the rehearsal, s: that of its radio. If omitted, it is
    chosen so that the total delay equals the vehicle's latency. Use 0 for a bridge on board."""
    out: Path | None = None
    """Folder for the rehearsal's report. If omitted, a new folder in the folder `rehearsals`."""
